"""Every second sample missing: the same record at half the rate has the same samples, and an exact answer."""

import numpy as np
import pytest

import allanite as al
from counts import records

pytestmark = pytest.mark.statistical

RATE, N, RECORDS = 100.0, 20_000, records(16, 40)


@pytest.mark.long
@pytest.mark.parametrize(
    ("truth", "fitted", "kind", "name"),
    [
        ("N(N=0.0126)+B(B=0.006)+K(K=4e-4)", "N+B+K", "B", "B"),
        ("N(N=0.0126)+GM(q_c=3e-3,T=20)", "N+GM", "GM", "q_c"),
    ],
)
def test_every_second_sample_says_what_half_the_rate_says(truth, fitted, kind, name):
    model = al.parse_model(truth)
    wanted = next(effect.values[name] for effect in model if name in effect.values)
    covered, limits, values = [], [], []
    for seed in range(RECORDS):
        samples = model.simulate(duration=N / RATE, rate=RATE, seed=seed).samples.copy()
        half = al.parse_model(fitted).fit(al.Recording(samples[::2].copy(), rate=RATE / 2.0))
        samples[1::2] = np.nan
        fit = al.parse_model(fitted).fit(al.Recording(samples, rate=RATE))
        low, high = fit[f"{kind}.{name}"].interval
        covered.append(low <= wanted <= high)
        limits.append(np.log(high / half[f"{kind}.{name}"].interval[1]))
        values.append((fit[f"{kind}.{name}"].value, half[f"{kind}.{name}"].value))
    # Of 16 intervals of 95 %, fewer than 13 hold the truth in 0.7 % of such tests, of 80 % (as B's once were) in 40 %, of
    # 70 % in 75 %; of 40 fewer than 34 in 0.3, 71 and 98 %. (benches/claims/missing_samples.py takes a hundred.)
    assert sum(covered) >= records(13, 34), sum(covered)
    # The share of the lowest ordinates is known to 5 %, the limit to about half of that, and the median of 16 to a quarter:
    # 17 % (an ordinate and its mirror image counted twice) is far outside.
    assert abs(np.median(limits)) < 0.08, np.median(limits)
    # The same maximum in every record, not one that the bridges of the holes suggest.
    assert all(mine < 5.0 * wanted or mine < 2.0 * theirs for mine, theirs in values), values

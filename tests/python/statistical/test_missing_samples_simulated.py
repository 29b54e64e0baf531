"""Every second sample missing: the same record at half the rate has the same samples, and an exact answer."""

import numpy as np
import pytest

import allanite as al

pytestmark = pytest.mark.statistical

RATE, N, RECORDS = 100.0, 20_000, 40


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
    # Of 40 intervals of 95 %, fewer than 34 hold the truth in 0.3 % of such tests.
    assert sum(covered) >= 34, sum(covered)
    # The share of the lowest ordinates is known to 5 %, the limit to about half of that: the median of 40 by less.
    assert abs(np.median(limits)) < 0.08, np.median(limits)
    # The same maximum in every record, not one that the bridges of the holes suggest.
    assert all(mine < 5.0 * wanted or mine < 2.0 * theirs for mine, theirs in values), values

"""How near the estimates come to the Cramér–Rao bound."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.effects.terms import RandomWalk, White
from allanite.fit.classical.gls import fit_gls, gls_factors
from counts import records
from information import bound

pytestmark = pytest.mark.statistical
N_SAMPLES, RATE, RECORDS = 2048, 1.0, records(300, 600)
CASES = {
    "N+K": (
        (1.0, 0.1),
        lambda rng: g.white(rng, N_SAMPLES, RATE, 1.0) + g.walk(rng, N_SAMPLES, RATE, 0.1),
    ),
    "N+GM": (
        (1.0, 0.5, 20.0),
        lambda rng: (
            g.white(rng, N_SAMPLES, RATE, 1.0) + g.gauss_markov(rng, N_SAMPLES, RATE, 0.5, 20.0)
        ),
    ),
}
NAMES = {"N+K": ("N", "K"), "N+GM": ("N", "GM.q_c", "GM.correlation_time")}


def test_the_bound_of_a_random_walk_is_that_of_its_ordinates():
    # The cosine transform diagonalises white noise and random walks: information ½ Σ (∂lnS)² over n − 1 ordinates.
    n, values = 300, (1.0, 0.1)
    j = np.arange(1, n)
    white, walk = (
        values[0] ** 2 * np.ones(n - 1),
        values[1] ** 2 / (4 * np.sin(np.pi * j / 2 / n) ** 2),
    )
    slopes = np.stack([2 * white, 2 * walk]) / (white + walk)
    np.testing.assert_allclose(
        bound("N+K", values, n, 1.0), np.linalg.inv(0.5 * slopes @ slopes.T), rtol=1e-6
    )


@pytest.mark.parametrize("name", CASES)
def test_whittle_is_within_ten_per_cent_of_the_bound(name):
    values, make = CASES[name]
    rng = np.random.default_rng([3, *name.encode()])
    logs = []
    for _ in range(RECORDS):
        fit = al.fit_model(al.Recording(make(rng), rate=RATE, unit="1"), name)
        logs.append([np.log(fit[key]) for key in NAMES[name]])
    best = np.diag(bound(name, values, N_SAMPLES, RATE))
    ratio = np.var(logs, axis=0) / best
    # 300 records know a variance to √(2/300) = 8.2 %, 600 to 5.8: 10 % and two of these. Half as much again as the bound
    # fails in 97 % of such tests. (benches/claims/efficiency.py takes more.)
    assert np.all(ratio < 1.1 + 2 * np.sqrt(2 / RECORDS)), ratio
    assert np.all(np.abs(np.mean(logs, axis=0) - np.log(values)) < 0.5 * np.sqrt(best))


def test_least_squares_throws_little_away():
    values, make = CASES["N+K"]
    rng = np.random.default_rng(4)
    factors = gls_factors(N_SAMPLES)
    units = [[White(1.0)], [RandomWalk(1.0)]]
    logs = []
    for _ in range(RECORDS):
        curve = al.oadev(make(rng), factors=factors)
        logs.append(0.5 * np.log(fit_gls(curve.deviation**2, factors, N_SAMPLES, units).squares))
    ratio = np.var(logs, axis=0) / np.diag(bound("N+K", values, N_SAMPLES, RATE))
    # Eight factors a decade to a quarter of the record: some per cent of N and of K are not seen.
    assert np.all(ratio < 1.35), ratio

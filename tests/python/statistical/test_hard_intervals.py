"""Intervals of two numbers that a fit knows badly: a ramp beside a drift, quantization at the edge of what is seen."""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import records

pytestmark = pytest.mark.statistical

RATE, LENGTH = 50.0, 180_000
N, B, K = 0.0126, 0.002, 9.07e-5
RAMP, STEP = 5.3e-5, 2.528e-4


def _noise(rng, walk=K):
    return (
        g.white(rng, LENGTH, RATE, N)
        + g.flicker(rng, LENGTH, RATE, B)
        + g.walk(rng, LENGTH, RATE, walk)
    )


def _fit(samples, model):
    return al.fit_model(al.Recording(samples, rate=RATE, unit="rad/s"), model)


def _share(inside):
    """(share of True, two and a half standard errors of a share of 95 % of so many records)."""
    return np.mean(inside), 2.5 * np.sqrt(0.95 * 0.05 / len(inside))


@pytest.mark.long
@pytest.mark.parametrize("times", [1.0, 10.0], ids=["K not seen", "K seen"])
def test_a_ramp_beside_flicker_and_random_walk(times):
    covered, at_the_fit = [], []
    for seed in range(records(80, 200)):
        rng = np.random.default_rng([seed, 31])
        fit = _fit(_noise(rng, times * K) + g.ramp(LENGTH, RATE, RAMP), "N+B+K+R")
        low, high = fit["R"].interval
        covered.append(low <= RAMP <= high)
        [ramp] = fit.solution.functions
        error = np.sqrt(ramp.covariance[0, 0])
        at_the_fit.append(abs(ramp.amplitudes[0] - RAMP) <= 1.959964 * error)
    share, slack = _share(covered)
    told = f"covered {share:.3f}, at the fitted coefficients {np.mean(at_the_fit):.3f}"
    # 80 records know 95 % to 2.4 %, so that 72 are enough: a true 90 % fails in 41 % of such tests, 85 % in 87 %; 200 know
    # it to 1.5 % and find 90 % in 72 % of them. More is allowed: where K is hidden, K might be anything below what is seen,
    # and the average over it gives 99 %.
    assert share >= 0.95 - slack, told
    if times == 1.0:
        # What the average is for: with K and B held at their fit, which K = 0 often is, 89 %. The same records miss, of 80
        # about 8 ± 3 more; without the average none.
        misses = np.sum(~np.array(at_the_fit)) - np.sum(~np.array(covered))
        assert misses >= records(3, 8), told


def test_quantization_beside_three_others():
    covered, above, below = [], 0, 0
    for seed in range(150):
        rng = np.random.default_rng([seed, 32])
        fit = _fit(_noise(rng) + g.quantization(rng, LENGTH, RATE, STEP), "N+B+K+Q")
        low, high = fit["Q"].interval
        covered.append(low <= STEP <= high)
        above += low > STEP
        below += high < STEP
    share, slack = _share(covered)
    # 150 records know 95 % to 1.8 %: 136 to 149 of them. (141 here.)
    assert 0.95 - slack <= share <= min(0.95 + slack, 0.999), (share, above, below)
    # Missed on either side alike: at most 9 of 150 at 2.5 % each, which has a chance of 1 %.
    assert max(above, below) <= 9, (share, above, below)

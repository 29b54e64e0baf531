"""A bias that follows the square of a temperature is named as such; an unrelated temperature is not."""

import numpy as np
import pytest

import allanite as al

RATE, N = 10.0, 54_000


def _record(seed, quadratic):
    time = np.arange(N) / RATE
    # A day's slope with a cycle of heating.
    temperature = 25.0 + 3.0 * np.sin(2 * np.pi * time / 2400.0) + 2.0 * time / time[-1]
    noise = al.parse_model("N(N=0.01)+B(B=5e-4)").simulate(duration=N / RATE, rate=RATE, seed=seed)
    samples = noise.samples + quadratic * (temperature - temperature.mean()) ** 2
    return al.Recording(samples, rate=RATE, covariates={"temperature": temperature})


@pytest.mark.slow
def test_a_square_is_named():
    for seed in (1, 2):
        fit = al.parse_model("N+B+K").fit(_record(seed, 5e-4))
        best = fit.check().significant[0]
        assert best.kind == "covariate"
        value = best.estimates["quadratic"]
        low, high = value.interval
        # 95 % intervals of two records, a standard error on either side for the chance that one misses.
        assert low - value.std_error < 5e-4 < high + value.std_error


@pytest.mark.slow
def test_no_square_where_there_is_none():
    for seed in (3, 4):
        check = al.parse_model("N+B+K").fit(_record(seed, 0.0)).check()
        assert not check.significant

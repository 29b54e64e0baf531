"""Average of predictions over the posterior of the coefficients of a noise model."""

import numpy as np
import pytest
from scipy.stats import t as student

import allanite as al
from allanite.clocks.holdover import PhaseModels, holdovers_of
from allanite.fit.stamped.candidates import Candidate, fit_noise
from allanite.fit.stamped.likelihood import StampedSeries
from allanite.fit.stamped.noise import integrated_noise
from allanite.fit.stamped.posterior import posterior_points


def fitted(values, effects):
    times = np.arange(values.size) - (values.size - 1.0)
    series = StampedSeries(times, values, np.ones((1, values.size)))
    return series, fit_noise(series, Candidate(effects), 1.0, integrated_noise)


@pytest.mark.parametrize("n", [12, 60])
def test_white_noise_with_unknown_level_is_predicted_by_students_t(n):
    # With a uniform prior in σ, the next sample has Student's t distribution with n − 2 degrees of freedom about the mean,
    # with variance S/(n − 2)·(1 + 1/n); S is the sum of squares about the mean (Gelman et al. 2013, section 3.2).
    values = np.random.default_rng(n).standard_normal(n)
    series, fit = fitted(values, (al.Quantization(),))
    [found] = holdovers_of([PhaseModels([fit], series)], [5.0], [np.ones((1, 1))])
    scale = np.sqrt(n * values.var() / (n - 2) * (1 + 1 / n))
    half = student(n - 2).ppf(0.975) * scale
    assert found.expected == pytest.approx(values.mean(), abs=1e-9)
    # 128 points: the interval scatters by about 1/√128 of its widening over that of a normal distribution.
    assert (found.low, found.high) == pytest.approx(
        (values.mean() - half, values.mean() + half), rel=0.04
    )


def test_a_coefficient_that_the_record_does_not_show_stays_near_zero():
    # White FM: the posterior of the random walk is flat below its upper limit, and the points spread over it.
    phase = np.cumsum(np.random.default_rng(2).standard_normal(400))
    series, fit = fitted(phase, (al.AngleRandomWalk(), al.RateRandomWalk()))
    best = fit.regressed.log_likelihood
    weights, values = posterior_points(
        fit, lambda noise: (series.regressed(noise).log_likelihood, noise.gauss_markov[0][0])
    )
    size = np.sqrt(values)
    assert weights.sum() == pytest.approx(1.0)
    # The effective number of points exceeds a quarter of all.
    assert 1.0 / np.sum(weights**2) > 0.25 * weights.size
    low = float(weights @ (size < 0.5 * (weights @ size)))
    assert 0.15 < low < 0.6
    assert max(series.regressed(fit.noise_of(fit.coefficients)).log_likelihood, best) == best

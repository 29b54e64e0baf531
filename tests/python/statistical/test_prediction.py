"""The standard error of a difference of predictions is right, and true effects are kept.

Records of 33 min at 10 Hz. An effect that is not there raises logL by ½χ² and costs twice the mean of that in
prediction: the mean difference is about ½ nat per parameter.
"""

import numpy as np
import pytest

import allanite as al
from allanite.fit.prediction import compare, predict
from generators import flicker, gauss_markov, ramp, sinusoid, walk, white

pytestmark = [pytest.mark.statistical, pytest.mark.xdist_group("prediction")]

LENGTH, RATE, N = 20_000, 10.0, 0.0126
T = LENGTH / RATE


def differences(seeds, before, after, make):
    """Difference, its standard error and the rise of logL of each record, shape (3, seeds)."""
    out = []
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 11])
        samples = white(rng, LENGTH, RATE, N) + make(rng)
        columns = {"u": walk(rng, LENGTH, RATE, 1.0)}
        recording = al.Recording(samples, RATE, unit="rad/s", covariates=columns)
        fits = [al.fit_model(recording, model) for model in (before, after)]
        found = compare(*(predict(f.data, f.solution) for f in fits))
        rise = fits[1].solution.log_likelihood - fits[0].solution.log_likelihood
        out.append((*found, rise))
    return np.array(out).T


def nothing(rng):
    return 0.0


@pytest.mark.parametrize("after", ["N+K", "N+B"])
def test_the_standard_error_of_a_random_effect_that_is_not_there(after):
    difference, error, _ = differences(120, "N", after, nothing)
    # Heavy tails (half of the differences are 0, the rest ½ − ½χ²): the spread of 120 is known to about 15 %.
    assert 0.75 <= np.sqrt((error**2).mean()) / difference.std() <= 1.35
    # Standard error of the mean 0.05.
    assert 0.05 <= difference.mean() <= 0.5
    assert 0.25 <= (difference > error).mean() <= 0.75


@pytest.mark.parametrize(
    ("before", "after", "make"),
    [
        ("N", "N+R", nothing),
        ("N+K", "N+K+COV(column=u,lag=0!)", lambda rng: walk(rng, LENGTH, RATE, 1e-3)),
    ],
)
def test_a_function_of_time_that_is_not_there(before, after, make):
    """Neutral or refused. The standard error is careful: χ² of the amplitude counts as z², although its variance is ½."""
    difference, error, _ = differences(36, before, after, make)
    # Standard error of the mean 0.13.
    assert 0.2 <= difference.mean() <= 1.5
    assert 0.8 <= np.sqrt((error**2).mean()) / difference.std() <= 2.0
    assert (difference > error).mean() >= 0.25
    assert (difference > -error).mean() >= 0.8


TRUE = {
    "line": ("N", "N+SIN(frequency=1)", lambda r, s: sinusoid(LENGTH, RATE, 1.0, 2.3e-3 * s)),
    "ramp": ("N", "N+R", lambda r, s: ramp(LENGTH, RATE, s * N * np.sqrt(360.0 / T**3))),
    "lag": (
        "N+K",
        "N+K+GM",
        lambda r, s: walk(r, LENGTH, RATE, 1e-4) + gauss_markov(r, LENGTH, RATE, 1.6e-3 * s, 10.0),
    ),
    "walk": ("N", "N+K", lambda r, s: walk(r, LENGTH, RATE, 1.6e-4 * s)),
    "flicker": ("N", "N+B", lambda r, s: flicker(r, LENGTH, RATE, 1.8e-3 * s)),
}


@pytest.mark.parametrize("size", [1.0, np.sqrt(2.0)])
@pytest.mark.parametrize("kind", TRUE)
def test_a_true_effect_is_not_refused(kind, size):
    """Expected ΔlogL about 15 and 30; no record in which it rose by 5 may be refused."""
    before, after, make = TRUE[kind]
    difference, error, rise = differences(12, before, after, lambda rng: make(rng, size))
    assert not (difference > error)[rise > 5.0].any()
    assert (difference < 0.0).mean() >= 0.8

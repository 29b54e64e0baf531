"""The Allan error of a true model is seldom beyond twice its expected scatter, which a verdict counts on."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 30_000

MODELS = {
    "N": lambda rng: g.white(rng, LENGTH, RATE, 0.01),
    "N+K": lambda rng: g.white(rng, LENGTH, RATE, 0.01) + g.walk(rng, LENGTH, RATE, 4e-4),
}


@pytest.mark.statistical
@pytest.mark.parametrize("name", list(MODELS))
def test_true_models_are_seldom_beyond_it(name):
    """In 2 % of records; more than 7 of 100 have a probability of 0.1 %."""
    over = 0
    for seed in range(100):
        log = al.Recording(MODELS[name](np.random.default_rng([seed, 5])), rate=RATE, unit="deg/s")
        error = al.fit_model(log, name).error
        over += error.adev_rms_percent > 2.0 * error.chance_rms_percent
    assert over <= 7

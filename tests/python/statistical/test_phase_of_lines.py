"""The interval of a line's phase counts the error of its frequency."""

import numpy as np
import pytest

import allanite as al

pytestmark = pytest.mark.statistical


def test_the_phase_covers_the_truth():
    z = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        phase, frequency = rng.uniform(-3, 3), 1.3 + 0.05 * rng.random()
        line = f"SIN(f={frequency},amplitude=0.15,phase={phase})"
        truth = al.parse_model(f"N(N=0.1)+{line}")
        log = truth.simulate(n=1500, rate=10, seed=seed, unit="deg/s")
        found = al.fit_model(log, f"N+SIN(f={frequency})")["SIN.phase"]
        apart = (float(found) - phase + np.pi) % (2 * np.pi) - np.pi
        z.append(apart / found.std_error)
    # A standard deviation of 40 is known to 11 %; with the frequency held it would be 2.
    assert 0.67 < np.std(z) < 1.33

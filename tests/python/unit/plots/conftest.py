"""A record with a lag and a line, fitted in steps, and the figures of it."""

import math

import numpy as np
import pytest

import allanite as al
from allanite.plots import plot_check, plot_deviation, plot_fit, plot_study, plot_time
from allanite.study import Rung

RATE = 50.0


def recording(unit="rad/s"):
    """White noise with a Gauss-Markov process and a line, by code independent of the effects."""
    rng = np.random.default_rng(7)
    n = 30_000
    lag = np.zeros(n)
    phi, kicks = math.exp(-1 / (RATE * 5.0)), rng.standard_normal(n)
    for i in range(1, n):
        lag[i] = phi * lag[i - 1] + 0.004 * kicks[i]
    line = 0.02 * np.sin(2 * np.pi * 3.0 * np.arange(n) / RATE)
    samples = 0.1 * rng.standard_normal(n) + lag + line
    return al.Recording(samples, rate=RATE, unit=unit, columns=["gyro_x"], path="some/demo.csv")


@pytest.fixture(scope="session")
def fits():
    first = al.fit_model(recording(), "N+B")
    second = first.add(al.GaussMarkov(correlation_time=5.0))
    return first, second, second.add(al.Sinusoid(frequency=3.0))


@pytest.fixture(scope="session")
def check(fits):
    return fits[0].check()


@pytest.fixture(scope="session")
def study(fits, check):
    added = (None, *(f.model.effects[-1] for f in fits[1:]))
    ladder = tuple(Rung(f, a) for f, a in zip(fits, added, strict=True))
    return al.Study(fits[0].recording, ladder, check, "nothing helps")


@pytest.fixture(scope="session")
def figures(fits, check, study):
    return {
        "fit": plot_fit(fits[2]),
        "check": plot_check(check),
        "study": plot_study(study),
        "time": plot_time(check),
        "deviation": plot_deviation(fits[0].recording.oadev()),
    }

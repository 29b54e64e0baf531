"""A ladder ends where effects run out, not where lines do: each has ordinates of its own, however near they are."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al

RATE, N = 100.0, 60_000


@pytest.mark.long
def test_eleven_lines_are_eleven_rungs():
    rng = np.random.default_rng(5)
    time = np.arange(N) / RATE
    # No two in a ratio of small integers, nor with harmonics in common.
    true = 3.1 * np.exp(0.2310 * np.arange(11) + 0.003 * np.arange(11) ** 2)
    x = 0.02 * rng.standard_normal(N)
    for k, frequency in enumerate(true):
        x += 0.003 * np.sin(2 * np.pi * frequency * time + k)
    study = al.improve(al.Recording(x, rate=RATE), "N")
    lines = sorted(e.frequency for e in study.fit.model if e.kind == "sinusoid")
    # 1/T apart; each is known to a tenth of that.
    np.testing.assert_allclose(lines, true, atol=0.2 / (N / RATE))
    assert study.stopped_because == "adequate"
    assert study.fit.model.name.count("+") == 11


@pytest.mark.slow
@pytest.mark.parametrize("frequencies", [(7.01, 7.05), (7.0, 7.1)])
def test_two_lines_in_one_bin_are_no_band(frequencies):
    """They lie in one bin, which a band explains better than one of them does."""
    time = np.arange(N) / RATE
    x = 0.02 * np.random.default_rng(8).standard_normal(N)
    # 24 and 60 times 1/T apart.
    for phase, frequency in enumerate(frequencies):
        x += 0.003 * np.sin(2 * np.pi * frequency * time + phase)
    study = al.improve(al.Recording(x, rate=RATE), "N")
    assert study.fit.model.name == "N" + len(frequencies) * "+SIN", study
    assert study.stopped_because == "adequate"

"""Noise that axes of one sensor or of two have in common is found and named once."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.axes.coherence import cross_spectra
from allanite.axes.lines import common_lines
from allanite.axes.shared import shared_noise
from documents import valid
from six_axes import NAMES, UNITS

N, RATE = 8192, 100.0


def recorded(x):
    return al.Recording(x, RATE, unit=UNITS, columns=NAMES)


def own_noise(rng, n=N):
    """Six independent axes with a density of 1."""
    return np.sqrt(RATE) * rng.standard_normal((n, 6))


def shared_of(log, model):
    fits = {c.columns[0]: al.fit_model(c, model) for c in log}
    return shared_noise(cross_spectra(fits), common_lines(fits), fits)


@pytest.mark.slow
def test_noise_of_a_gyroscope_and_an_accelerometer_is_named_once():
    """Supply noise: half of the variance of three axes of one sensor and, with opposite sign, of one of the other."""
    rng = np.random.default_rng(3)
    x = own_noise(rng)
    x[:, [0, 1, 2, 4]] += np.sqrt(RATE) * rng.standard_normal((N, 1)) * [1.0, 1.0, 1.0, -1.0]
    found = al.characterize(recorded(x), "N", limit=0)
    (one,) = found.common.shared
    assert one.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_y")
    # A coherence of ¼ needs 80 ordinates to be significant among 15 pairs of 9 octaves.
    assert one.low < 2.0
    assert one.high == 50.0
    # Of 2048 ordinates in the highest octave, six pairs: ¼ to 4 · 0.75 · √(2 · 0.25/2048).
    assert one.band.coherence == pytest.approx(0.25, abs=0.05)
    assert len(found.common.cross) == 9
    assert all(len(sensor.cross) == 3 for sensor in found.common.sensors)
    text = found.table()
    assert text.count("shared noise") == 1
    assert max(map(len, text.splitlines())) <= 100
    assert "uncorrelated" in text  # the accelerometer's
    document = valid(found.to_dict())["common"]
    assert document["shared_noise"][0]["columns"] == list(one.columns)
    assert document["shared_noise"][0]["line_hz"] is None
    assert len(document["cross_spectra"]) == 9


def test_independent_axes_share_nothing():
    log = recorded(own_noise(np.random.default_rng(4)))
    assert shared_of(log, "N") == ()


def test_a_vibration_that_all_axes_see_is_named_once():
    """Its coherence is not named again; noise that axes share elsewhere is."""
    rng = np.random.default_rng(5)
    n = 4 * N
    x = own_noise(rng, n) + 4.0 * g.resonance(rng, n, RATE, 18.0, 0.03, 1.0)[:, None]
    (one,) = shared_of(recorded(x), "N+RES(f=18,damping=0.03)")
    assert set(one.columns) == set(NAMES)
    assert one.line is not None
    assert one.line.frequency == pytest.approx(18.0, abs=4.0 * one.line.std_error)
    assert str(one).startswith(f"{one.line}; coherence")
    # Slow noise of two axes, of nine times their density below 0.5 Hz.
    x[:, [1, 3]] += g.gauss_markov(rng, n, RATE, 10.0, 0.3)[:, None]
    model = "N+RES(f=18,damping=0.03)+GM(T=0.3)"
    first, second = shared_of(recorded(x), model)
    assert first.line is not None
    assert second.line is None
    assert second.columns == ("gyro_y", "acc_x")
    assert second.band.high < 3.0


def test_columns_of_different_lengths_are_not_compared():
    rng = np.random.default_rng(6)
    fits = {
        str(n): al.fit_model(al.Recording(rng.normal(size=n), RATE, unit="deg/s"), "N")
        for n in (1000, 1000 + 1, 1000 - 1)
    }
    assert cross_spectra(fits) == ()

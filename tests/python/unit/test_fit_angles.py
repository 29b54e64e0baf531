"""Samples that are angles: one rate fewer than samples, outliers included."""

import numpy as np
import pytest

import allanite as al


def test_outliers_of_angle_samples():
    """A rate that spikes three times, integrated to an angle: N is that of the noise once the spikes are named."""
    rng = np.random.default_rng(8)
    rate, n = 10.0, 4001
    increments = 0.1 * np.sqrt(rate) * rng.standard_normal(n - 1) / rate
    increments[[700, 1500, 3000]] += 1.0
    angle = np.concatenate([[0.0], np.cumsum(increments)])
    recording = al.Recording(angle, rate=rate, unit="deg", quantity="angle")
    spikes = al.Outliers(times=(70.0, 150.0, 300.0))
    with_spikes = al.AngleRandomWalk().fit(recording)["N"]
    without = (al.AngleRandomWalk() + spikes).fit(recording)["N"]
    # 4000 ordinates know N to 1.1 %; 4 σ.
    assert without.value == pytest.approx(0.1, rel=0.045)
    assert with_spikes.value > 0.12

"""A slow hump of the bias, hidden in flicker noise, is named instead of a random walk."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, LENGTH = 10.0, 108_000
N, B = 0.004, 8e-4
TIME = np.arange(LENGTH) / RATE


def _study(rng, hump):
    x = g.white(rng, LENGTH, RATE, N) + g.flicker(rng, LENGTH, RATE, B) + hump
    return al.improve(al.Recording(x, rate=RATE, unit="deg/s"))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_hump_of_the_temperature_is_no_random_walk(seed):
    """ΔlogL is (height/B)²/2 = 72 in flicker noise. The standard errors are B/√2·1.4 and width/12; three of each."""
    study = _study(
        np.random.default_rng(seed), 12.0 * B * np.exp(-0.5 * ((TIME - 5200.0) / 400.0) ** 2)
    )
    assert study.adequate, study
    assert "hump" in [e.kind for e in study.fit.model], study
    assert study.fit["HUMP.height"].value == pytest.approx(12.0 * B, abs=3.0 * B)
    assert study.fit["HUMP.time"].value == pytest.approx(5200.0, abs=100.0)
    assert not study.fit["K"].detected


def test_ordinates_of_humps_near_the_ends_equal_their_transform():
    from scipy.fft import dct

    j = np.arange(1, 900)
    humps = [
        al.effects.Hump(width=w, time=t, height=1.0)
        for w, t in ((90.0, 200.0), (300.0, 5000.0), (100.0, 10_750.0))
    ]
    found = al.effects.Hump.regressor_ordinates(humps, j, LENGTH, RATE, 0.0)
    expected = np.array([dct(h.regressors(TIME, {})[:, 0], norm="ortho")[j] for h in humps])
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()

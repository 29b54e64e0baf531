"""A wandering line with side bands is one modulated vibration; other lines beside it are not."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, LENGTH = 50.0, 120_000
N, APART = 0.0126, 0.31
TIME = np.arange(LENGTH) / RATE


def _study(rng, vibration):
    x = g.white(rng, LENGTH, RATE, N) + g.walk(rng, LENGTH, RATE, 9e-5) + vibration
    return al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N+K")


def _added(study):
    # The slow noise of the start model may be replaced by one that explains it as well.
    return [e.kind for e in study.fit.model if e.occupies is not None]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_load_that_comes_and_goes_is_one_effect(seed):
    rng = np.random.default_rng(seed)
    carrier = g.resonance(rng, LENGTH, RATE, 9.0, 3e-4, 0.03)
    study = _study(rng, (1.0 + 0.6 * np.cos(2.0 * np.pi * APART * TIME + 1.0)) * carrier)
    assert _added(study) == ["modulated_vibration"], study
    assert study.adequate, study
    # Half-width · T · 2 is 13 ordinates of each of three bands: their power is known to √(2/13), the depth to half of two
    # of these, and the middle of a side band to a half-width over √(13/2); three standard errors of each.
    assert abs(study.fit["MOD.modulation"].value - APART) < 3.0 * 2.7e-3 / np.sqrt(
        13 / 2
    ) * np.sqrt(2.0)
    assert study.fit["MOD.depth"].value == pytest.approx(
        0.6, rel=3.0 * 0.5 * np.sqrt(2 / 13 + 1 / 13)
    )
    for name in ("frequency", "damping", "rms", "modulation", "depth"):
        low, high = study.fit[f"MOD.{name}"].interval
        assert low < study.fit[f"MOD.{name}"].value < high


@pytest.mark.long
def test_a_band_wider_than_a_bin_has_side_bands_too():
    """Damping of 1 %, bins of 1.2 %; side bands of 0.2 of the power are twelve half-widths away."""
    rng, rate, n = np.random.default_rng(11), 100.0, 30_000
    swing = 1.0 + 0.9 * np.sin(2.0 * np.pi * 1.5 * np.arange(n) / rate)
    x = g.white(rng, n, rate, 0.01) + swing * g.resonance(rng, n, rate, 12.0, 0.01, 0.02)
    study = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N")
    assert [e.kind for e in study.fit.model][1:] == ["modulated_vibration"], study
    # A band of 0.24 Hz has 72 independent values in 300 s: the middle of two side bands is known to 0.12/√72.
    assert study.fit["MOD.modulation"].value == pytest.approx(1.5, abs=3.0 * 0.12 / np.sqrt(72))


@pytest.mark.long
def test_a_speed_that_swings_is_one_effect():
    rng = np.random.default_rng(3)
    wander = np.cumsum(rng.standard_normal(LENGTH)) * np.sqrt(4.0 * np.pi * 2e-3 / RATE)
    swing = 0.5 * np.sin(2.0 * np.pi * APART * TIME)
    study = _study(rng, 0.04 * np.sin(2.0 * np.pi * 9.0 * TIME + wander + swing))
    assert _added(study) == ["modulated_vibration"], study
    # Side bands of a phase that swings by β have J₁²/J₀² = (β/2)² (1 + β²/8 + …) of the power: m = 1.03 β here. A band has
    # ten ordinates, but its companions are copies of it, so that the depth is known better than √(3/10)/2; 1.3 of these.
    assert study.fit["MOD.depth"].value == pytest.approx(0.515, rel=0.35)


@pytest.mark.long
def test_its_harmonics_have_side_bands_of_their_own():
    rng = np.random.default_rng(4)
    wander = np.cumsum(rng.standard_normal(LENGTH)) * np.sqrt(4.0 * np.pi * 1e-3 / RATE)
    phase = 2.0 * np.pi * 4.0 * TIME + wander + 0.4 * np.sin(2.0 * np.pi * APART * TIME)
    study = _study(rng, 0.05 * np.sin(phase) + 0.03 * np.sin(3.0 * phase))
    assert _added(study) == ["modulated_vibration"] * 2, study
    first, third = sorted(study.fit.model.effects[2:4], key=lambda e: e.frequency)
    assert third.frequency == pytest.approx(3.0 * first.frequency, rel=1e-3)
    assert third.modulation == pytest.approx(first.modulation, abs=6e-3)
    assert third.depth > 1.5 * first.depth


@pytest.mark.long
@pytest.mark.parametrize("seed", range(5, 9))
def test_a_line_that_only_wanders_is_a_resonance(seed):
    rng = np.random.default_rng(seed)
    study = _study(rng, g.resonance(rng, LENGTH, RATE, 9.0, 3e-4, 0.03))
    # One check in a hundred names something that is not there.
    assert "resonance" in _added(study), study
    assert "modulated_vibration" not in _added(study), study


@pytest.mark.long
def test_two_machines_are_two_bands():
    rng = np.random.default_rng(10)
    first = g.resonance(rng, LENGTH, RATE, 9.0, 3e-4, 0.03)
    study = _study(rng, first + g.resonance(rng, LENGTH, RATE, 9.31, 3e-4, 0.012))
    assert _added(study) == ["resonance"] * 2, study


def test_simulated_samples_have_the_side_bands_of_the_model():
    model = al.parse_model("MOD(frequency=9,damping=3e-3,rms=1,modulation=2,depth=1)")
    record = model.simulate(n=400_000, rate=RATE, seed=1, unit="rad/s")
    power = np.abs(np.fft.rfft(record.samples)) ** 2
    f = np.fft.rfftfreq(record.n, 1.0 / RATE)
    strength = [power[abs(f - at) < 0.3].sum() for at in (9.0, 7.0, 11.0)]
    # 2·0.027 Hz · 8000 s bandwidths in each: √(2/430) of its power, of both 10 % at three standard errors of a ratio.
    for side in strength[1:]:
        assert side / strength[0] == pytest.approx(0.25, rel=0.3)

"""A band that is elsewhere at other times is told where a model fails; one that stays is not, nor where a model holds."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.criticism.moving_bands import moving_bands

RATE, LENGTH = 100.0, 200_000
TIME = np.arange(LENGTH) / RATE


def _vibration(rng, course, width, rms):
    """Narrow-band noise about a frequency that changes: a complex first-order process, turned on by its phase."""
    keep = np.exp(-2.0 * np.pi * width / RATE)
    steps = (rng.standard_normal(LENGTH) + 1j * rng.standard_normal(LENGTH)) * np.sqrt(1 - keep**2)
    slow = np.empty(LENGTH, dtype=complex)
    state = steps[0] / np.sqrt(1 - keep**2)
    for k, step in enumerate(steps):
        slow[k] = state = keep * state + step
    return rms * np.real(slow * np.exp(2j * np.pi * np.cumsum(course) / RATE))


def _recording(seed, course, rms=0.05):
    rng = np.random.default_rng(seed)
    x = g.white(rng, LENGTH, RATE, 0.0126) + _vibration(rng, course, 0.4, rms)
    return al.Recording(x, rate=RATE, unit="rad/s")


@pytest.mark.parametrize("seed", range(3))
def test_a_machine_whose_speed_falls_is_seen_to(seed):
    course = 20.0 + 2.5 * np.exp(-TIME / 400.0)
    study = al.improve(_recording(seed, course), "N", limit=1)
    assert not study.check.adequate
    [band] = study.check.moving
    (start, end, first), (_, last_end, last) = band.places
    # The middle is known to half a step of a quarter of the half-width, which the drift widens, and falls within a section.
    assert (start, end) == (0.0, pytest.approx(125.0))
    assert first == pytest.approx(course[: LENGTH // 16].mean(), abs=0.4)
    assert last == pytest.approx(20.0, abs=0.4)
    assert last_end > 1000.0
    told = " ".join(study.check.left)
    assert f"{first:.3g} Hz in 0–125 s" in told
    assert "drifts" in told
    assert "drifts" in str(study)


def test_a_band_that_stays_does_not_move():
    """Neither where its model holds nor where something else is missing."""
    for seed in range(5):
        fit = al.fit_model(_recording(seed, np.full(LENGTH, 20.0)), "N+RES(f=20,damping=0.02)")
        assert moving_bands(fit) == ()
        assert fit.check().moving == ()
    rng = np.random.default_rng(9)
    x = g.white(rng, LENGTH, RATE, 0.0126) + g.resonance(rng, LENGTH, RATE, 20.0, 0.02, 0.05)
    x = g.louder(x + g.resonance(rng, LENGTH, RATE, 31.0, 0.02, 0.05), RATE, 500.0, 900.0, 1.3)
    fit = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), "N+RES(f=20,damping=0.02)")
    check = fit.check()
    assert check.where.fails
    assert check.moving == ()


def test_what_stands_for_the_rest_of_a_moving_band_is_not_another():
    course = 20.0 + 2.5 * np.exp(-TIME / 400.0)
    for other in ("RES(f=24!,damping=0.1!)", "RES(f=17!,damping=0.1!)"):
        check = al.fit_model(_recording(4, course), f"N+RES(f=20,damping=0.02)+{other}").check()
        [band] = check.moving
        assert band.frequency == pytest.approx(20.0, abs=0.5)


@pytest.mark.parametrize("damping", [0.005, 0.05, 0.12, 0.2, 0.29])
@pytest.mark.parametrize("frequency", [0.5, 8.0, 48.0])
def test_a_band_of_any_width_anywhere_is_looked_for(frequency, damping):
    rng = np.random.default_rng(6)
    x = g.white(rng, LENGTH, RATE, 0.0126)
    x += g.resonance(rng, LENGTH, RATE, frequency, damping, 0.05)
    model = f"N+RES(f={frequency}!,damping={damping}!)"
    assert moving_bands(al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), model)) == ()

"""Lines that a record cannot resolve: one that wanders is a narrow band, two that beat are two."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, LENGTH = 50.0, 25_000
DURATION = LENGTH / RATE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "half_width"), [(0, 3e-4), (2, 1e-3), (9, 3e-4), (18, 3e-4), (20, 1e-3), (23, 1e-3)]
)
def test_a_line_that_wanders_is_no_pair_that_cancels(seed, half_width):
    """It wanders by a seventh or a half of the frequency resolution; three beating lines leave some of it."""
    rng = np.random.default_rng(seed)
    x = g.white(rng, LENGTH, RATE, 0.0126)
    x += g.moving_band(rng, LENGTH, RATE, np.full(LENGTH, 1.35), half_width, 0.025)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert [e.kind for e in study.fit.model.effects[1:]] == ["resonance"], study
    assert study.adequate, study


@pytest.mark.slow
@pytest.mark.parametrize("apart", [1.5, 2.5, 6.0])
def test_two_that_beat_stay_two(apart):
    rng = np.random.default_rng(7)
    x = g.white(rng, LENGTH, RATE, 0.0126)
    x += g.sinusoid(LENGTH, RATE, 1.35, 0.02) + g.sinusoid(
        LENGTH, RATE, 1.35 + apart / DURATION, 0.01, 1.0
    )
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert [e.kind for e in study.fit.model.effects[1:]] == ["sinusoid"] * 2, study
    assert study.adequate, study


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_side_lobes_of_a_strong_line_are_no_line(seed):
    """Side lobes of twice the noise were once a second line, which seemed to wander."""
    rng, n = np.random.default_rng(seed), 60_000
    line = 0.02 * np.sin(2.0 * np.pi * 7.3 * np.arange(n) / 50.0 + 0.4)
    log = al.Recording(line + 0.0106 * rng.standard_normal(n), rate=50, unit="m/s^2")
    check = al.fit_model(log, "N+B+K").check()
    (only,) = check.significant
    assert only.effect.values["amplitude"] == pytest.approx(0.02, rel=1e-2)
    assert not any("pure line" in s.explanation for s in check.suggestions)

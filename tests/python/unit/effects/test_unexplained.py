"""A smooth shape of the spectrum that no effect of the catalog explains, made by filtering white noise with it."""

from dataclasses import replace

import numpy as np
import pytest

import allanite as al
from allanite.study import Rung, Study

RATE, N, LEVEL = 100.0, 60_000, 0.01
FREQUENCY = np.fft.rfftfreq(N, 1.0 / RATE)


def bump(frequency):
    """A hump of 80 % of the power about 3 Hz, one and a half octaves wide."""
    octaves = np.log2(np.maximum(frequency, 1e-9) / 3.0)
    return 1.0 + 0.8 * np.exp(-0.5 * (octaves / 0.7) ** 2)


def shaped(shape, seed):
    """White noise of density LEVEL² with this shape of the density."""
    drawn = np.fft.rfft(np.random.default_rng(seed).standard_normal(N)) * np.sqrt(shape)
    return al.Recording(LEVEL * np.sqrt(RATE) * np.fft.irfft(drawn, N), rate=RATE, unit="rad/s")


@pytest.fixture(scope="module")
def record():
    return shaped(bump(FREQUENCY), 1)


def test_what_is_left_is_described_and_said(record):
    """An octave at 3 Hz has 3 600 ordinates, 2.4 % of its power; one band instead of two would leave up to 15 %."""
    fit = al.fit_model(record, "N+X")
    assert fit.adequate, fit
    f = np.geomspace(0.5, 45.0, 30)
    np.testing.assert_allclose(fit.model.psd(f, RATE), LEVEL**2 * bump(f), rtol=0.15)
    # The bands reach as far as the rate shows: what they add there is not in N.
    assert fit["N"].value == pytest.approx(LEVEL, rel=0.06)
    # What the model without it lacks is at most 80 % of the power, at half of that from 1.3 to 6.8 Hz.
    from allanite.suggestion.unexplained_shape import unexplained_shape

    rest = unexplained_shape(al.fit_model(record, "N+B+K"))
    assert 0.6 < rest.low_hz < 2.6, rest
    assert 4.0 < rest.high_hz < 12.0, rest
    assert 40.0 < rest.percent < 130.0
    assert "no effect of the catalog explains" in str(rest)
    assert unexplained_shape(fit) is None


def test_it_is_simulated_and_saved(record, tmp_path):
    fit = al.fit_model(record, "N+X")
    fit.model.save(str(tmp_path / "model.json"))
    assert al.parse_model(str(tmp_path / "model.json")) == fit.model
    twin = fit.simulate(duration=N / RATE, seed=2)
    again = al.fit_model(twin, fit.model)
    f = np.geomspace(1.0, 40.0, 12)
    np.testing.assert_allclose(again.model.psd(f, RATE), fit.model.psd(f, RATE), rtol=0.1)


@pytest.mark.slow
def test_white_noise_has_none():
    record = shaped(np.ones(FREQUENCY.size), 3)
    fit = al.fit_model(record, "N+X")
    assert not fit["X.rms"].detected
    check = al.fit_model(record, "N").check()
    assert check.adequate
    assert check.unexplained_shape is None


@pytest.mark.long
def test_a_stack_that_only_describes_gives_way():
    """Two or more resonances would have names that the hump does not deserve."""
    study = al.improve(shaped(bump(FREQUENCY), 4), "N")
    kinds = [effect.kind for effect in study.fit.model]
    assert kinds == ["angle_random_walk", "unexplained"], study
    assert study.verdict == "adequate"
    assert study.ladder[-1].added.kind == "unexplained"


def test_bands_that_are_none_are_refused():
    for bands in ((1.0,), (1.0, -0.5), ()):
        with pytest.raises(al.AllaniteError, match="bands"):
            al.effects.Unexplained(rms=1.0, bands=bands)


def test_a_line_and_a_band_at_one_frequency_are_one_thing():
    """A line added to a model with the band, and the reverse: one of them stays."""
    from allanite.study.moves.add import with_addition
    from allanite.study.state import State

    rng = np.random.default_rng(5)
    time = np.arange(N) / RATE
    line = shaped(np.ones(FREQUENCY.size), 5).samples + 0.02 * np.sin(2.0 * np.pi * 7.0 * time)
    record = al.Recording(line, rate=RATE, unit="rad/s")
    band = al.fit_model(record, "N+RES(frequency=7,damping=0.001)")
    before = State.of(band, 1)
    after = with_addition(before, al.Sinusoid(frequency=7.0))
    assert [e.kind for e in after.fit.model] == ["angle_random_walk", "sinusoid"]
    assert after.lost_since(before) == (1,)
    # What the start has stays; a band says no more of a line than the line.
    assert with_addition(State.of(band), al.Sinusoid(frequency=7.0)) is None
    pure = al.fit_model(record, "N+SIN(frequency=7)")
    alone = State.of(pure, 1)
    assert with_addition(alone, al.effects.Resonance(frequency=7.0, damping=0.001)) is None
    apart = with_addition(alone, al.Sinusoid(frequency=9.0, amplitude=rng.uniform(0.0, 1e-3)))
    assert [e.kind for e in apart.fit.model][1:] == ["sinusoid", "sinusoid"]


def test_two_lines_at_one_frequency_are_both_put_back():
    """Functions that a fit subtracts are identified by effect, not by shape."""
    record = shaped(np.ones(FREQUENCY.size), 6)
    two = al.fit_model(
        record,
        "N+SIN(frequency=7!,amplitude=0.01!,phase=0!)+SIN(frequency=7!,amplitude=0.02!,phase=0!)",
    )
    left = two.remove(2).remove(1)
    np.testing.assert_allclose(
        left.solution.ordinates, al.fit_model(record, "N").solution.ordinates, atol=1e-9
    )


@pytest.mark.slow
def test_what_is_missing_is_grouped_by_the_misfit_it_explains():
    truth = al.parse_model("N(N=0.01)+SIN(f=2.5,A=0.01)+STEP(time=200,height=0.02)")
    record = truth.simulate(duration=600, rate=10, seed=1, unit="deg/s")
    check = al.AngleRandomWalk().fit(record).check()
    groups = dict(check.grouped)
    ((_, first),) = groups["what is missing"]
    assert first is check.suggestions[0]
    kinds = {title: {s.kind for _, s in group} for title, group in check.grouped}
    other = "bias_step" if first.kind == "sinusoid" else "sinusoid"
    assert other in kinds["in addition to 1"]
    assert "in addition to 1:" in str(check)
    # The rank is that of the document.
    for _, group in check.grouped:
        assert all(check.suggestions[rank - 1] is s for rank, s in group)


def test_what_is_not_significant_removes_nothing():
    check = (
        al.AngleRandomWalk()
        .fit(al.AngleRandomWalk(N=0.1).simulate(duration=300, rate=10, seed=1))
        .check()
    )
    assert "not significant" in str(check)
    assert "removes" not in str(check)
    assert "no view fails significantly" in str(check)


def test_what_is_said_where_no_view_fails_follows_from_the_verdict():
    truth = al.parse_model("N(N=0.01)+SIN(f=2.5,A=0.01)")
    fit = al.AngleRandomWalk().fit(truth.simulate(duration=300, rate=10, seed=1))
    check = fit.check()
    assert not check.adequate
    assert check.nowhere == "significantly missing: sinusoid"
    # A search that ended early has not refused the effect, so that no other sentence names it.
    study = Study(fit.recording, (Rung(fit),), check, "time")
    assert study.left[-1] == check.nowhere
    bare = replace(check, suggestions=())
    assert bare.adequate or "whole curve" in bare.nowhere


@pytest.mark.long
def test_a_stack_does_not_stand_for_the_white_noise():
    """A peaking equalizer: resonances and a power law once described it, without white noise."""
    w, gain = 2.0 * np.pi * 15.0 / RATE, 1.35
    alpha = 0.75 * np.sin(w)
    b = [1.0 + alpha * gain, -2.0 * np.cos(w), 1.0 - alpha * gain]
    a = [1.0 + alpha / gain, -2.0 * np.cos(w), 1.0 - alpha / gain]
    z = np.exp(-2j * np.pi * FREQUENCY[: N // 4 + 1] * 2.0 / RATE)
    shape = np.abs(np.polyval(b[::-1], z) / np.polyval(a[::-1], z)) ** 2
    half = N // 2
    drawn = np.fft.rfft(np.random.default_rng(8).standard_normal(half)) * np.sqrt(shape)
    x = LEVEL * np.sqrt(RATE) * np.fft.irfft(drawn, half)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert study.fit["N"].detected, study
    assert "unexplained" in [e.kind for e in study.fit.model], study

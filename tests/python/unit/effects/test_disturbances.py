"""Someone moves the sensor for a while: that stretch is taken out, and no resonance stands for it."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al
from allanite.study.moves.add import with_addition
from allanite.study.state import State

RATE, N = 25.0, 60_000
MODEL = "N+B+K"


def _noise(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 0.02 * rng.standard_normal(N) + 1e-4 * np.cumsum(rng.standard_normal(N))


def _walked(x: np.ndarray, start: float, end: float, seed: int) -> np.ndarray:
    """Irregular steps of about 1.9 Hz, because a hand is no sine, and swings with them."""
    rng = np.random.default_rng(seed)
    time = np.arange(N) / RATE
    phase = np.cumsum(2 * np.pi * (1.9 + 0.3 * rng.standard_normal(N)) / RATE)
    swing = 0.2 * np.sin(phase) + 0.1 * np.sin(0.37 * phase)
    return x + np.where((time >= start) & (time < end), swing, 0.0)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_a_sensor_that_was_carried_is_taken_out_for_that_time(seed):
    x = _walked(_noise(seed), 1500.0, 1560.0, seed + 100)
    fit = al.parse_model(MODEL).fit(al.Recording(x, rate=RATE))
    first = fit.check().suggestions[0]
    assert first.kind == "disturbance"
    # Times are those of a stretch of the loudest octave: some swings either side.
    assert 1490.0 < first.effect.start <= 1500.5
    assert 1559.5 <= first.effect.end < 1570.0
    after = fit.add(first).check()
    assert after.adequate, after
    assert after.fit["N"].value == pytest.approx(0.02 / np.sqrt(RATE), rel=0.01)


@pytest.mark.long
def test_two_times_are_two_stretches():
    x = _walked(_walked(_noise(3), 300.0, 340.0, 5), 1900.0, 1960.0, 6)
    study = al.improve(al.Recording(x, rate=RATE), model=MODEL)
    found = [e for e in study.fit.model if e.kind == "disturbance"]
    assert sorted(round(e.start, -2) for e in found) == [300.0, 1900.0]
    assert study.fit.check().adequate


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_tap_is_no_resonance(seed):
    """Neighboring outliers are one event, whatever rang; other seeds of taps are found as a segment."""
    rng = np.random.default_rng(seed)
    since = np.arange(N) / RATE - rng.uniform(400.0, 2000.0)
    ring = np.exp(-np.maximum(since, 0.0) / 0.5) * np.sin(2 * np.pi * 6.0 * since)
    study = al.improve(al.Recording(_noise(seed) + 0.6 * ring * (since > 0.0), rate=RATE), MODEL)
    named = [rung.added.kind for rung in study.ladder[1:]]
    assert named
    assert {*named} <= {"outliers", "disturbance", "noise_level_change"}, study
    assert study.adequate, study


def test_a_value_that_stands_still_is_taken_out():
    x = _noise(5)
    x[20_000:20_400] = x[20_000]
    first = al.fit_model(al.Recording(x, rate=RATE), MODEL).check().suggestions[0]
    assert first.kind == "disturbance"
    assert (first.effect.start, first.effect.end) == (20_000 / RATE, 20_399 / RATE)
    assert "One value stands for 400 samples from 800 s" in first.explanation
    assert first.found.check().adequate


def _held(x: np.ndarray, places: np.ndarray, seed: int) -> np.ndarray:
    """A link that loses samples: each loss repeats the last value 1 + Geometric(0.3) times."""
    rng = np.random.default_rng(seed)
    for at in places:
        x[at : at + 2 + rng.geometric(0.3)] = x[at]
    return x


def test_the_longest_of_many_holds_is_no_event():
    """The longest of 1000 holds has over 16 samples. A value held for 400 samples is an event."""
    places = np.random.default_rng(8).integers(0, N - 100, 1000)
    x = _held(_noise(7), places, 9)
    kinds = [s.kind for s in al.fit_model(al.Recording(x, rate=RATE), MODEL).check().significant]
    assert "disturbance" not in kinds
    x[20_000:20_400] = x[20_000]
    check = al.fit_model(al.Recording(x, rate=RATE), MODEL).check()
    stuck = next(s for s in check.significant if s.kind == "disturbance")
    assert (stuck.effect.start, stuck.effect.end) == (20_000 / RATE, 20_399 / RATE)


def test_each_of_a_few_lost_links_is_one():
    """A few long holds of other values do not make holds of this length usual."""
    x = _noise(10)
    for first in range(5_000, N, 12_000):
        x[first : first + 100] = x[first]
    first = al.fit_model(al.Recording(x, rate=RATE), MODEL).check().suggestions[0]
    assert first.kind == "disturbance"
    assert "One value stands for 100 samples" in first.explanation


def test_samples_lost_to_zero_are_no_lag():
    """If the mean is far from 0, a lost sample that is written as 0 is an outlier, anywhere in the record."""
    rng = np.random.default_rng(6)
    x = _noise(6) + 0.3
    for at in rng.integers(0, N, 30):
        x[at : at + rng.integers(1, 6)] = 0.0
    first = al.fit_model(al.Recording(x, rate=RATE), MODEL).check().suggestions[0]
    assert first.kind == "outliers", first
    after = first.found.check()
    assert after.adequate, after
    assert after.fit["N"].value == pytest.approx(0.02 / np.sqrt(RATE), rel=0.01)


@pytest.mark.long
def test_a_stretch_that_is_taken_out_has_no_level():
    """The end of a shaking is louder than the rest, but not than the excluded samples."""
    from scipy.signal import butter, sosfilt

    for seed in range(4):
        rng = np.random.default_rng([seed, 5])
        shaken = sosfilt(butter(2, 4.0, fs=RATE, output="sos"), rng.standard_normal(N))
        time = np.arange(N) / RATE - rng.uniform(400.0, 2000.0)
        x = _noise(seed) + 0.1 * shaken / shaken.std() * ((time > 0.0) & (time < 10.0))
        found = al.improve(al.Recording(x, rate=RATE), MODEL).fit.model.effects
        out = [e.when for e in found if e.kind == "disturbance"]
        levels = [e.when for e in found if e.kind == "noise_level_change"]
        assert out or levels, found
        assert len(levels) < 2, found
        assert all(a[1] <= b[0] or b[1] <= a[0] for a in out for b in levels), found


def _step(x, time):
    return x + 0.05 * (time > 1100.0)


def _pulse(x, time):
    return x + 0.3 * np.where(time > 1100.0, np.exp(-(time - 1100.0) / 20.0), 0.0)


def _louder(x, time):
    return x + 0.05 * np.random.default_rng(9).standard_normal(N) * (
        (time > 1100.0) & (time < 1300.0)
    )


def _ringing(x, time):
    """A permanent narrow band, whose amplitude always varies."""
    from scipy.signal import lfilter

    e = 0.002 * np.random.default_rng(10).standard_normal(N)
    r, w = 0.999, 2 * np.pi * 6.0 / RATE
    return x + lfilter([1.0], [1.0, -2 * r * np.cos(w), r * r], e)


@pytest.mark.parametrize("other", [_step, _pulse, _louder, _ringing])
def test_what_explains_the_stretch_is_left_in(other):
    x = other(_noise(7), np.arange(N) / RATE)
    check = al.parse_model(MODEL).fit(al.Recording(x, rate=RATE)).check()
    assert check.significant
    assert all(s.kind != "disturbance" for s in check.suggestions)


def test_the_noise_alone_has_none():
    """Two distributions of the samples; one record in a thousand may have one (FALSE_ALARM 0.01 over ten families)."""
    for seed in range(4):
        x = _noise(seed)
        if seed % 2:
            x += 0.02 * np.random.default_rng(seed + 50).standard_t(4, N)
        check = al.parse_model(MODEL).fit(al.Recording(x, rate=RATE)).check()
        assert all(s.kind != "disturbance" for s in check.significant)


def test_the_ends_of_a_filtered_record_are_none():
    """Behind a decimator, the stop band holds only what the ends of the transform leave."""
    from scipy import signal

    taps = signal.firwin(32, 0.2)
    rng = np.random.default_rng(0)
    x = 0.126 * rng.standard_normal(N + 31) + 9e-6 * np.cumsum(rng.standard_normal(N + 31))
    x = signal.fftconvolve(x, taps, "valid")
    check = al.parse_model(MODEL).fit(al.Recording(x, rate=RATE)).check()
    assert check.suggestions[0].kind != "disturbance"
    assert all(s.kind != "disturbance" for s in check.significant)


@pytest.mark.parametrize(("start", "end"), [(-1.0, 60.0), (2340.0, 2401.0)])
def test_motion_at_an_end_is_one(start, end):
    x = _walked(_noise(8), start, end, 12)
    check = al.parse_model(MODEL).fit(al.Recording(x, rate=RATE)).check()
    assert "disturbance" in [s.kind for s in check.significant]


def test_a_summary_has_no_samples_to_take_out():
    rng = np.random.default_rng(4)
    x = rng.standard_normal(1 << 19)
    x[100_000:110_000] += 3.0 * np.sin(0.1 * np.arange(10_000))
    summary = al.summarize([al.Recording(x, rate=RATE)])
    check = al.AngleRandomWalk().fit(summary).check()
    assert all(s.kind != "disturbance" for s in check.suggestions)
    with pytest.raises(al.InputError, match="disturbances need single samples"):
        al.parse_model("N+DIST(start=2000,end=2200)").fit(summary)


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_record_of_hardly_three_values_has_none(seed):
    """A walk below a step of three standard deviations is no louder segment."""
    x = _noise(seed) + 0.0006 * np.cumsum(np.random.default_rng(seed).standard_normal(N)) / 60.0
    check = al.fit_model(al.Recording(np.round(x / 0.06) * 0.06, rate=RATE), MODEL).check()
    assert not [s for s in check.significant if s.kind == "disturbance"], check


def test_a_coarse_record_that_was_carried_has_one():
    x = _walked(_noise(2), 1500.0, 1560.0, 102)
    check = al.fit_model(al.Recording(np.round(x / 0.06) * 0.06, rate=RATE), MODEL).check()
    first = next(s.effect for s in check.significant if s.kind == "disturbance")
    # Of so coarse a record half of the stretch may be added at either side.
    assert 1470.0 - 1.0 < first.start <= 1500.5
    assert 1559.5 <= first.end < 1590.0


@pytest.mark.slow
@pytest.mark.parametrize(("first", "last"), [(0.0, 30.0), (800.0, 860.0), (2340.0, 2400.0)])
def test_a_strong_shaking_is_as_long_as_it_lasts(first, last):
    """An octave filtered out of the spectrum rings for a minute after a thousand times its power.

    Each end may be off by half a window of eight periods of the lowest octave that shows the end (0.6 Hz: 7 s). The
    record without the shaking has no effect.
    """
    time = np.arange(N) / RATE
    x = _noise(11) + np.where((time >= first) & (time < last), np.sin(2 * np.pi * 1.9 * time), 0.0)
    study = al.improve(al.Recording(x, rate=RATE), model=MODEL)
    out = [e for e in study.fit.model if e.kind not in {"angle_random_walk", "rate_random_walk"}]
    assert [e.kind for e in out if e.kind != "bias_instability"] == ["disturbance"], study
    [found] = [e for e in out if e.kind == "disturbance"]
    assert max(0.0, first - 7.0) <= found.start <= first
    assert last <= found.end <= min(N / RATE, last + 7.0)
    assert study.adequate


@pytest.mark.long
def test_what_happened_in_a_stretch_that_is_taken_out_leaves():
    """A warm-up, outliers and a segment were named before the whole segment, which then contains all of them."""
    time = np.arange(N) / RATE
    shaken = (time >= 700.0) & (time < 760.0)
    x = _noise(12) + np.where(shaken, np.random.default_rng(3).standard_normal(N), 0.0)
    inside = [
        al.effects.Excursion(start=702.0, end=705.0),
        al.effects.Outliers(count=3, times=(701.0, 730.0, 755.0)),
        al.effects.Disturbance(start=710.0, end=712.0),
    ]
    outside = [
        al.effects.BiasStep(time=300.0),
        al.effects.Outliers(count=3, times=(10.0, 2000.0, 730.0)),
    ]
    for effect in (*inside, *outside):
        whole = al.effects.Disturbance(start=699.0, end=761.0)
        fit = al.fit_model(al.Recording(x, rate=RATE), al.parse_model(MODEL) + effect)
        before = State.of(fit, 3)
        found = with_addition(before, whole)
        assert found is not None
        left = [e.kind for e in found.fit.model.effects[3:]]
        assert left == (["disturbance"] if effect in inside else [effect.kind, "disturbance"])
        assert found.lost_since(before) == ((3,) if effect in inside else ())


def test_a_ramp_is_not_of_the_end_of_a_record():
    """Although more than half of its energy is in the last fifth."""
    x = _noise(13) + 1e-4 * np.arange(N) / RATE
    fit = al.fit_model(al.Recording(x, rate=RATE), al.parse_model(MODEL) + al.RateRamp())
    found = with_addition(State.of(fit, 3), al.effects.Disturbance(start=1950.0, end=2400.0))
    assert found is not None
    assert [e.kind for e in found.fit.model.effects[3:]] == ["rate_ramp", "disturbance"]

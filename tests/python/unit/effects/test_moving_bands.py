"""A band whose frequency changes over the record is one effect; one that stays is a resonance."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

import allanite as al
import generators as g
from allanite.axes.lines import common_lines
from allanite.effects import segment_weights
from allanite.effects.resonance import Resonance
from allanite.suggestion.screens.drifting_bands import (
    PLACES_PER_HALF_WIDTH,
    most_likely_course,
    most_likely_polygon,
)

RATE, LENGTH = 100.0, 200_000
TIME = np.arange(LENGTH) / RATE
WARMS_UP = 20.0 + 2.5 * np.exp(-TIME / 400.0)


def _recording(seed, course, rms=0.05):
    rng = np.random.default_rng(seed)
    x = g.white(rng, LENGTH, RATE, 0.0126) + g.moving_band(rng, LENGTH, RATE, course, 0.2, rms)
    return al.Recording(x, rate=RATE, unit="rad/s")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_machine_whose_speed_falls_is_one_effect(seed):
    study = al.improve(_recording(seed, WARMS_UP), "N")
    assert [e.kind for e in study.fit.model] == ["angle_random_walk", "drifting_resonance"], study
    assert study.adequate, study
    left = study.misfit_left
    assert left[-1] < left[-2]
    band = study.fit.model.effects[1]
    parts = np.array_split(WARMS_UP, len(band.course))
    # Each is known to a quarter of a half-width, 0.2 Hz, and to what it moves by within its part.
    assert np.abs(np.array(band.course) - [p.mean() for p in parts]).max() < 0.3
    assert study.fit["DRES.rms"].value == pytest.approx(0.05, rel=0.05)
    assert study.fit["N"].value == pytest.approx(0.0126, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 2])
def test_a_weak_band_that_drifts_by_sixty_half_widths_is_no_line(seed):
    """It has five times the noise at any time, a sixth in the mean spectrum, and strong chance lines within."""
    rng, n = np.random.default_rng([seed, 5]), 30_000
    x = g.white(rng, n, RATE, 0.01) + g.flicker(rng, n, RATE, 2e-3)
    x += g.moving_band(rng, n, RATE, 8.0 + 6.0 * np.arange(n) / n, 0.1, 1.8e-2)
    study = al.improve(al.Recording(x, rate=RATE, unit="deg/s"), "N+B")
    kinds = {e.kind for e in study.fit.model}
    assert "drifting_resonance" in kinds, study
    assert not kinds & {"drifting_line", "resonance", "sinusoid"}, study


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_engine_that_slows_down_is_no_disturbance(seed):
    """Two harmonics of an idle engine; their first, highest frequencies are loud for a short time only."""
    rng, n, rate = np.random.default_rng([seed, 8]), 30_000, 50.0
    t = np.arange(n) / rate
    speed = 9.3 - 1.2 * (1.0 - np.exp(-t / 200.0)) + g.gauss_markov(rng, n, rate, 0.02, 10.0)
    phase = 2.0 * np.pi * np.cumsum(speed) / rate
    x = g.white(rng, n, rate, 1e-3) + g.flicker(rng, n, rate, 1e-3)
    study = al.improve(
        al.Recording(x + 0.005 * np.sin(phase) + 0.003 * np.sin(2.0 * phase), rate, unit="m/s^2"),
        "N+B",
    )
    assert study.ladder[1].changes == ("+ drifting resonance",), study
    kinds = [e.kind for e in study.fit.model]
    assert kinds.count("drifting_resonance") == 2, study
    assert not any("level" in kind or kind == "disturbance" for kind in kinds), study


@pytest.mark.slow
def test_a_check_suggests_it_in_the_place_of_the_band():
    fit = al.fit_model(_recording(5, WARMS_UP), "N+RES(f=20,damping=0.05)")
    [found] = [s for s in fit.check().significant if s.kind == "drifting_resonance"]
    assert found.replaced_kinds == ("resonance",)
    assert "drifting resonance" in found.explanation
    assert "It stands in the place of the resonance at 20.1 Hz." in found.explanation
    better = fit.add(found)
    assert better.model.name == "N+DRES"
    assert better.check().adequate


@pytest.mark.long
def test_a_band_that_stays_does_not_move():
    """This holds if its model is right, and if something else is missing."""
    moved = 0
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        x = g.white(rng, LENGTH, RATE, 0.0126) + g.resonance(rng, LENGTH, RATE, 20.0, 0.02, 0.05)
        if seed % 2:
            x += g.resonance(rng, LENGTH, RATE, 24.0, 0.02, 0.02)
            x = g.louder(x, RATE, 500.0, 900.0, 1.3)
        fit = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), "N+RES(f=20,damping=0.02)")
        moved += any(
            s.kind == "drifting_resonance" for s in fit.check().suggestions if s.significant
        )
    assert moved == 0


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.005, 0.05, 0.12, 0.2, 0.29])
@pytest.mark.parametrize("frequency", [0.5, 8.0, 48.0])
def test_a_band_of_any_width_anywhere_is_looked_for(frequency, damping):
    rng = np.random.default_rng(6)
    x = g.white(rng, LENGTH, RATE, 0.0126)
    x += g.resonance(rng, LENGTH, RATE, frequency, damping, 0.05)
    model = f"N+RES(f={frequency}!,damping={damping}!)"
    check = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), model).check()
    assert "drifting_resonance" not in [s.kind for s in check.significant]


@given(st.integers(1, 4), st.integers(2, 4), st.integers(0, 2**32 - 1))
def test_the_likeliest_course_is_the_best_of_all(sections, places, seed):
    gains = 2.0 * np.random.default_rng(seed).standard_normal((sections, places))
    step = 1.0 / (
        1.0 + (np.subtract.outer(range(places), range(places)) / PLACES_PER_HALF_WIDTH) ** 2
    )
    told = np.log(step / step.sum(axis=1, keepdims=True))

    def total(course):
        of_steps = sum(told[a, b] for a, b in pairwise(course))
        return sum(gains[k, f] for k, f in enumerate(course)) + of_steps - np.log(places)

    course, risen = most_likely_course(gains)
    best = max(map(total, product(range(places), repeat=sections)))
    assert risen == pytest.approx(best)
    assert total(course) == pytest.approx(best)


@given(st.integers(1, 2), st.integers(1, 3), st.integers(2, 4), st.integers(0, 2**32 - 1))
def test_the_likeliest_polygon_is_the_best_of_all(parts, size, places, seed):
    gains = 2.0 * np.random.default_rng(seed).standard_normal((parts * size, places))
    middles = (np.arange(parts * size) + 0.5) / size

    def total(corners):
        course = np.rint(np.interp(middles, range(parts + 1), corners)).astype(int)
        return gains[range(parts * size), course].sum() - (parts + 1) * np.log(places)

    course, risen = most_likely_polygon(gains, parts)
    assert risen == pytest.approx(max(map(total, product(range(places), repeat=parts + 1))))
    assert course.shape == (parts * size,)


@pytest.mark.parametrize(
    "search", [most_likely_course, lambda gains: most_likely_polygon(gains, 4)]
)
def test_a_course_is_met_by_chance_as_seldom_as_said(search):
    """Ratios of normal densities with mean 1: a sum of logs above s has a probability of at most e⁻ˢ, for any course."""
    rng = np.random.default_rng(1)
    shift = 1.5
    risen = np.array(
        [search(shift * rng.standard_normal((16, 20)) - 0.5 * shift**2)[1] for _ in range(2000)]
    )
    for s in (1.0, 2.0, 4.0):
        # Three standard errors of a share of 2000.
        bound = np.exp(-s)
        assert np.mean(risen > s) < bound + 3.0 * np.sqrt(bound / 2000)


@pytest.mark.long
@pytest.mark.parametrize("seed", [2, 3])
def test_what_is_simulated_is_where_its_course_says(seed):
    course = tuple(np.linspace(22.0, 20.0, 32).tolist())
    band = al.effects.DriftingResonance(course=course, damping=0.01, rms=0.05)
    model = al.AngleRandomWalk(N=0.005) + band
    x = model.simulate(duration=2000, rate=RATE, seed=seed).samples
    for part, middle in ((x[:20_000], 21.9), (x[-20_000:], 20.1)):
        f, density = signal.welch(part, RATE, nperseg=2048)
        assert f[density.argmax()] == pytest.approx(middle, abs=0.2)
    # A half-width of 0.2 Hz for 2000 s: 1300 independent values of the variance, known to 4 %.
    assert x.std() == pytest.approx(np.hypot(0.05, 0.005 * np.sqrt(RATE)), rel=0.06)
    chunks = model.simulate_chunks(duration=2000, rate=RATE, seed=seed, size=7001)
    pieces = [p.samples for p in chunks]
    assert np.array_equal(np.concatenate(pieces), x)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert [e.kind for e in study.fit.model] == ["angle_random_walk", "drifting_resonance"], study


def test_its_density_is_the_mean_of_its_parts():
    band = al.effects.DriftingResonance(course=(11.0, 10.0, 10.5), damping=0.02, rms=0.3)
    f = np.linspace(1.0, 49.0, 200)
    parts = [Resonance(frequency=c, damping=0.02, rms=0.3).psd(f, rate=RATE) for c in band.course]
    assert band.psd(f, rate=RATE) == pytest.approx(np.mean(parts, axis=0), rel=1e-12)
    share = segment_weights(np.linspace(0.0, 90.0, 9001), (0.0, 90.0), 3)
    assert share.sum(axis=0) == pytest.approx(1.0)
    assert share.mean(axis=1) == pytest.approx(1.0 / 3.0, abs=1e-3)


@pytest.mark.parametrize(
    "filtering", ["HP(f=4,order=2)", "NOTCH(f=9,Q=3)", "BW(f=8,order=2,acts_on=all,design=digital)"]
)
def test_behind_a_filter_it_is_the_mean_of_its_parts_there(filtering):
    """All exponentials of the course pass the filter together, those of a single band one by one."""
    course = tuple(np.linspace(8.0, 12.0, 9))
    f, filters = np.linspace(0.5, 49.0, 400), al.parse_model(filtering)
    moving = (filters + al.effects.DriftingResonance(course=course, damping=0.02, rms=0.1)).psd(
        f, rate=100.0
    )
    parts = [
        (filters + al.effects.Resonance(frequency=c, damping=0.02, rms=0.1)).psd(f, rate=100.0)
        for c in course
    ]
    assert moving == pytest.approx(np.mean(parts, axis=0), rel=1e-9, abs=1e-12 * moving.max())


def test_a_course_is_checked():
    with pytest.raises(al.InputError, match="two frequencies"):
        al.effects.DriftingResonance(course=(10.0,))
    with pytest.raises(al.InputError, match="above 0"):
        al.effects.DriftingResonance(course=(10.0, -1.0))


def test_a_course_may_be_wide():
    """From 2 to 20 Hz: an eighth of the course is wider than a resonance may be at the lower end."""
    course = np.geomspace(2.0, 20.0, LENGTH)
    places = tuple(course[:: LENGTH // 80][1::2].tolist())
    model = al.AngleRandomWalk() + al.effects.DriftingResonance(course=places)
    fit = al.fit_model(_recording(0, course), model)
    # 0.2 Hz wide at any time: 0.01 of 20 Hz and 0.1 of 2 Hz, one damping for all.
    assert fit["DRES.rms"].value == pytest.approx(0.05, rel=0.1)
    assert 0.01 < fit["DRES.damping"].value < 0.1


@pytest.mark.long
def test_two_axes_that_feel_one_machine_say_so_once():
    fits = {}
    for seed, axis in enumerate("xy"):
        recording = _recording(seed, WARMS_UP, rms=0.05 / (1 + seed))
        fits[axis] = al.improve(recording, "N").fit
    [line] = common_lines(fits)
    assert line.columns == ("x", "y")
    assert line.kinds == ("drifting_resonance",) * 2
    # Half a width of 0.2 Hz for each of at most 64 parts; four of these for the means of both.
    assert line.frequency == pytest.approx(WARMS_UP.mean(), abs=4.0 * line.std_error)
    assert str(line).endswith("(drifting resonance): x, y")


@pytest.mark.long
def test_a_band_that_fits_only_one_place_does_not_move():
    """A band almost as wide as the spectrum."""
    n, rate = 20_000, 10.0
    rng = np.random.default_rng([1, 7])
    white = 0.01 * np.sqrt(rate) * rng.standard_normal(n + 500)
    response = np.cumprod(np.r_[1.0, (0.5 + np.arange(4 * n - 1)) / np.arange(1, 4 * n)])
    flicker = signal.fftconvolve(rng.standard_normal(4 * n), response)[3 * n : 4 * n]
    x = signal.lfilter(*signal.butter(2, 0.5), white)[500:] + 3e-3 * flicker
    x += 1e-3 * rate * np.diff(rng.standard_normal(n + 1))
    study = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N+B")
    assert len(study.ladder) > 1

"""What leaves its level for a while is one event with two times; what decays is one, too; a step stays a step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
import generators as g
from allanite.effects._event import sines
from allanite.fit.solution import Regressed
from allanite.suggestion.screens.slow_functions import has_known_time

MG = 9.81e-3


def _quiet(rng, n, rate):
    """An accelerometer of 100 µg/√Hz in m/s²."""
    white = g.white(rng, n, rate, 0.1 * MG)
    return white + g.flicker(rng, n, rate, 0.02 * MG) + g.walk(rng, n, rate, 1e-3 * MG)


@pytest.mark.long
def test_a_disturbance_of_minutes_is_one_event():
    """5 mg for 400 s, half an hour at 20 Hz: both times to a tenth of a second, and no other effect."""
    rate, n = 20.0, 36_000
    rng = np.random.default_rng([0, 5])
    time = np.arange(n) / rate
    x = _quiet(rng, n, rate) + 5.0 * MG * ((time >= 700.0) & (time < 1100.0))
    study = al.improve(al.Recording(x, rate, unit="m/s^2", columns=("acc_x",)), "N+B+K")
    slow = [
        e
        for e in study.fit.model
        if isinstance(e, al.effects.Excursion | al.effects.BiasStep | al.effects.Transient)
    ]
    assert [e.kind for e in slow] == ["excursion"], study.fit.model
    assert (slow[0].start, slow[0].end) == (
        pytest.approx(700, abs=0.1),
        pytest.approx(1100, abs=0.1),
    )
    low, high = study.fit["height"].interval
    assert low < 5.0 * MG < high
    assert study.adequate
    assert slow[0].when == (slow[0].start, slow[0].end)


FORMS = {
    "bias_step": lambda t: 0.12 * (t >= 800.0),
    "excursion": lambda t: 0.15 * ((t >= 800.0) & (t < 1000.0)),
    "transition": lambda t: 0.3 * np.clip((t - 700.0) / 300.0, 0.0, 1.0),
    "transient": lambda t: (
        0.3 * np.where(t >= 800.0, np.exp(-np.maximum(t - 800.0, 0.0) / 120.0), 0.0)
    ),
}
TRUTH = {
    "bias_step": {"time": 800.0, "height": 0.12},
    "excursion": {"start": 800.0, "end": 1000.0, "height": 0.15},
    "transition": {"begin": 700.0, "end": 1000.0, "height": 0.3},
    "transient": {"time": 800.0, "time_constant": 120.0, "height": 0.3},
}


@pytest.mark.parametrize("kind", FORMS)
def test_each_is_named_and_measured(kind):
    rate, n = 10.0, 18_000
    rng = np.random.default_rng([3, *kind.encode()])
    x = g.white(rng, n, rate, 0.1) + g.flicker(rng, n, rate, 0.01) + g.walk(rng, n, rate, 2e-4)
    x += FORMS[kind](np.arange(n) / rate)
    first = al.parse_model("N+B+K").fit(al.Recording(x, rate)).check().suggestions[0]
    assert (first.kind, first.significant, first.effect_happens_once) == (kind, True, True)
    for name, value in TRUTH[kind].items():
        found = first.estimates[name]
        # One record of three numbers each: two standard errors and one more.
        assert abs(found.value - value) < 3.0 * found.std_error, (name, found)


@pytest.mark.statistical
def test_nothing_comes_back_where_nothing_left():
    """12 records without events: with 1 % of false alarms, one has any in 11 %, two in 0.6 %."""
    rate, n = 10.0, 12_000
    raised = 0
    for seed in range(12):
        rng = np.random.default_rng([seed, 9])
        x = g.white(rng, n, rate, 0.1) + g.flicker(rng, n, rate, 0.01)
        raised += bool(al.parse_model("N+B+K").fit(al.Recording(x, rate)).check().significant)
    assert raised <= 1


@given(st.integers(8, 3 * 10**6), st.integers(1, 300), st.integers(1, 5000), st.integers(1, 50))
@settings(max_examples=30)
def test_sines_of_many_places_are_single_sines(n, places, ordinates, first):
    k = np.linspace(0, n, places).round()
    j = np.arange(first, first + ordinates)
    # Arguments of up to πj are rounded, on either way.
    np.testing.assert_allclose(
        sines(k, j, n), np.sin(np.pi * j * k[:, None] / n), atol=1e-15 * np.pi * j[-1] + 1e-14
    )


def _stretch(time, start, end, height):
    return height * ((time >= start) & (time < end))


@pytest.mark.long
def test_short_excursions_are_not_hidden_by_a_step_elsewhere():
    """Someone leans on the bench twice, with a step in between, so that no edge of either visit is the best single step."""
    rate, n = 20.0, 40_000
    rng = np.random.default_rng([2, 77])
    time = np.arange(n) / rate
    x = g.white(rng, n, rate, 0.02) + g.walk(rng, n, rate, 2e-3)
    x += _stretch(time, 310.0, 322.0, 0.11) + _stretch(time, 1650.0, 1668.0, -0.1)
    x += 0.3 * (time >= 1000.0)
    fit = al.improve(al.Recording(x, rate), "N+K").fit
    step, visits = sorted(fit.model.deterministic, key=lambda e: e.kind)
    assert step.kind == "bias_step"
    assert round(step.time) == 1000
    assert [tuple(round(t) for t in e.when) for e in visits.singly] == [(310, 322), (1650, 1668)]


@given(st.integers(8, 60), st.integers(0, 3), st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=60)
def test_the_best_span_is_the_best_of_all_pairs(size, others, seed):
    """Sine transforms against every pair of steps, one by one."""
    rng = np.random.default_rng(seed)
    n, rate = 40 * (size + 1), 10.0
    j = np.arange(1, size + 1)
    root = np.exp(rng.normal(size=size))
    residual = rng.normal(size=size)
    basis = np.linalg.qr(rng.normal(size=(size, min(others, size))))[0]
    left = residual - basis @ (basis.T @ residual)
    times = np.arange(1, size + 1) * (n / rate / (size + 1))
    rows = al.effects.BiasStep.regressor_ordinates(
        [al.effects.BiasStep(time=t) for t in times], j, n, rate, 0.0
    )
    rows = rows * root
    rows -= (rows @ basis) @ basis.T
    best = max(
        0.5 * float(d @ left) ** 2 / float(d @ d) - np.log(k - i)
        for i in range(size)
        for k in range(i + 1, size)
        if (d := rows[i] - rows[k]) @ d > 1e-6 * (rows[i] @ rows[i])
    )
    (found, arc), _ = al.effects.BiasStep.best_spans(residual, root, basis, n, rate)
    i, k = (int(np.argmin(abs(times - t))) for t in found.when)
    d = rows[i] - rows[k]
    assert 0.5 * float(d @ left) ** 2 / float(d @ d) - np.log(k - i) == pytest.approx(best)
    unit = rows / np.linalg.norm(rows, axis=1)[:, None]
    turned = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(axis=1), -1.0, 1.0)).sum()
    assert arc == pytest.approx(turned, rel=1e-6)


@given(st.integers(8, 60), st.integers(0, 3), st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=60)
def test_the_best_transition_is_the_best_of_all_pairs(size, others, seed):
    """Cosine transforms against every pair of kinks, one by one."""
    rng = np.random.default_rng(seed)
    n, rate = 4000 * (size + 1), 10.0
    j = np.arange(1, size + 1)
    root = j * np.exp(rng.normal(size=size))
    residual = rng.normal(size=size)
    basis = np.linalg.qr(rng.normal(size=(size, min(others, size))))[0]
    left = residual - basis @ (basis.T @ residual)
    times = np.arange(1, size + 1) * (n / rate / (size + 1))
    pairs = [(a, b) for a in times for b in times if a < b]
    rows = root * al.effects.Transition.regressor_ordinates(
        [al.effects.Transition(begin=a, end=b) for a, b in pairs], j, n, rate, 0.0
    )
    rows *= np.array([b - a for a, b in pairs])[:, None]
    rows -= (rows @ basis) @ basis.T
    squares = (rows**2).sum(axis=1)
    gain = np.where(squares > 1e-6 * squares.max(), 0.5 * (rows @ left) ** 2 / squares, 0.0)
    _, (found, _) = al.effects.BiasStep.best_spans(residual, root, basis, n, rate)
    row = root * al.effects.Transition.regressor_ordinates([found], j, n, rate, 0.0)[0]
    row -= basis @ (basis.T @ row)
    # The search leaves out half a sample of the kinks' places, of at least 4000 between two.
    assert 0.5 * (row @ left) ** 2 / (row @ row) == pytest.approx(gain.max(), rel=1e-2)


@pytest.mark.parametrize("seed", range(3))
def test_a_slow_change_of_level_is_no_walk_and_no_step(seed):
    """A rise of 20 minutes in six hours with a weak walk: one transition, and K is not that of the rise."""
    n, rng = 21_600, np.random.default_rng([seed, 31])
    time = np.arange(float(n))
    rise = 2e-3 * np.clip((time - 12_000.0) / 1200.0, 0.0, 1.0)
    x = g.white(rng, n, 1.0, 1.5e-3) + g.walk(rng, n, 1.0, 4e-7) + rise
    study = al.improve(al.Recording(x, 1.0, unit="rad/s"), "N+B+K")
    (found,) = study.fit.model.deterministic
    assert found.kind == "transition"
    for name, value in (("begin", 12_000.0), ("end", 13_200.0), ("height", 2e-3)):
        low, high = study.fit[name].interval
        # Three parameters of three records: wider by a half than 95 % intervals.
        assert low - 0.25 * (high - low) < value < high + 0.25 * (high - low), name
    walk = study.fit["K"]
    assert walk.interval[0] < 4e-7 < walk.interval[1]


@pytest.mark.parametrize(("term", "lasts"), [("EXC", False), ("RISE", True)])
def test_two_unknown_times_are_found_without_a_start_value(term, lasts):
    """Pairs of a thousand times: a grid of all pairs would take 32 GB."""
    rate, n = 10.0, 20_000
    time = np.arange(n) / rate
    change = (
        np.clip((time - 600.0) / 300.0, 0.0, 1.0) if lasts else (time >= 600.0) & (time < 900.0)
    )
    x = g.white(np.random.default_rng(1), n, rate, 0.01) + 0.02 * change
    found = al.fit_model(al.Recording(x, rate=rate, unit="deg/s"), f"N+{term}").model.effects[1]
    # An edge: 11 N²/h² = 3 s. A ramp of slope s over T: the times of its kinks are known to N/(s √T), 9 s; three of these.
    assert found.when == pytest.approx((600.0, 900.0), abs=27.0 if lasts else 3.0)
    assert found.height == pytest.approx(0.02, abs=4.0 * 0.01 / np.sqrt(300.0))


@pytest.mark.parametrize(
    ("time", "deviation", "placed"),
    [(500.0, 0.1, True), (500.0, 0.2, False), (996.0, 0.1, True), (996.0, 0.3, False)],
)
def test_a_jump_whose_time_may_be_outside_the_record_is_not_placed(time, deviation, placed):
    """Standard errors of the times: 14 s and 56 s (the limit is 20 s), 0.6 s and 5 s (4 s before the end)."""
    step = al.effects.BiasStep(time=time, height=1.0)
    fit = al.fit_model(al.Recording(np.random.default_rng(1).standard_normal(1000), 1.0), "N")
    own = Regressed(step, np.ones(1), np.full((1, 1), deviation**2), np.ones((1, 1)), step)
    assert has_known_time(own, fit.solution, fit.data) == placed


@pytest.mark.parametrize(("begin", "placed"), [(5000.0, True), (9700.0, False)])
def test_a_transition_that_may_end_after_the_record_is_not_placed(begin, placed):
    """A rise of 1 in 270 s, in noise of density 4: the standard error of its ends is √(4 · 270) · 2 s, at mid-record."""
    n, rng = 10_000, np.random.default_rng(0)
    rise = np.clip((np.arange(n) - begin) / 270.0, 0.0, 1.0)
    fit = al.fit_model(al.Recording(rng.standard_normal(n) * 2.0 + rise, 1.0), "N+RISE")
    assert has_known_time(fit.solution.effects[1], fit.solution, fit.data) == placed


@pytest.mark.parametrize("seed", range(3))
def test_a_decay_of_seconds_is_one_transient(seed):
    """After a restart, the sensor settles in 5 s of a record of two hours: no step, and no ramps that cancel."""
    rate, n = 5.0, 40_000
    rng = np.random.default_rng([seed, 21])
    x = g.white(rng, n, rate, 0.0028) + g.walk(rng, n, rate, 2e-4)
    since = np.arange(n) / rate - 2000.0 * (seed + 1)
    x += np.where(since >= 0.0, 0.06 * np.exp(-np.maximum(since, 0.0) / 5.0), 0.0)
    first = al.parse_model("N+K").fit(al.Recording(x, rate)).check().suggestions[0]
    assert (first.kind, first.significant) == ("transient", True)
    assert first.effect.time == pytest.approx(2000.0 * (seed + 1), abs=1.0)
    low, high = first.estimates["time_constant"].interval
    assert low < 5.0 < high


def test_a_step_within_excluded_samples_has_no_known_time():
    """The bias changes while the sensor is carried: both times may be anywhere in the excluded segment."""
    rate, n = 50.0, 20_000
    rng = np.random.default_rng(3)
    time = np.arange(n) / rate
    x = g.white(rng, n, rate, 0.001) + 0.3 * (time > 204.0)
    x[(time > 200.0) & (time < 208.0)] += 0.5
    there = "N+DIST(start=200,end=208)+RISE(begin=202,end=206)"
    values = al.fit_model(al.Recording(x, rate, unit="m/s^2"), there).estimates[-1]
    for name in ("begin", "end"):
        low, high = values[name].interval
        assert low <= 200.0
        assert high >= 208.0
    low, high = values["height"].interval
    assert low < 0.3 < high < 0.31


@pytest.mark.parametrize("kind", [e.kind for e in al.effects.CATALOG if e.happens_once])
def test_every_event_can_be_estimated_beside_a_gap(kind):
    """Times of some events are single numbers, those of others are tuples."""
    rng = np.random.default_rng(7)
    x = g.white(rng, 4000, 10.0, 0.01)
    x[1900:2100] = np.nan
    x[[*range(1000, 1100), *range(2500, 2650)]] += 0.5
    both = {"starts": (100.0, 250.0), "ends": (110.0, 265.0), "heights": (0.5, 0.5)}
    effect = al.effects.find(kind)(**(both if kind == "excursions" else {}))
    fit = al.fit_model(al.Recording(x, rate=10.0), al.parse_model("N") + effect)
    assert fit.estimates[-1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_sensor_and_its_housing_settle_with_two_time_constants(seed):
    """Amplitudes 0.02 (40 s) and 0.05 (900 s) in an hour. A warm-up and a ramp have 13 nats less than two warm-ups."""
    rate, n = 5.0, 18_000
    rng = np.random.default_rng([seed, 8])
    time = np.arange(n) / rate
    x = g.white(rng, n, rate, 0.003) + g.flicker(rng, n, rate, 0.001)
    x += 0.02 * np.exp(-time / 40.0) + 0.05 * np.exp(-time / 900.0)
    study = al.improve(al.Recording(x, rate, unit="deg/s"), "N+B")
    assert study.adequate
    assert [e.short for e in study.fit.model] == ["N", "B", "WARM", "WARM"], study
    assert not al.effects.WarmUp.candidates(study.fit.model, {})


@pytest.mark.parametrize(
    ("moved", "kind"),
    [((905.0, 905.1), "bias_step"), ((910.0, 920.0), "bias_step"), ((860.0, 970.0), "transition")],
)
def test_a_change_of_level_within_a_gap_is_a_step(moved, kind):
    # Without samples during the change nothing shows its duration; a change that samples show has one.
    n, rate = 4000, 2.0
    time = np.arange(n) / rate
    rng = np.random.default_rng(3)
    samples = g.white(rng, n, rate, 0.01)
    samples += 0.03 * np.clip((time - moved[0]) / (moved[1] - moved[0]), 0.0, 1.0)
    samples[(time >= 900.0) & (time < 930.0)] = np.nan
    check = al.fit_model(al.Recording(samples, rate=rate, unit="deg/s"), "N").check()
    named = [s.kind for s in check.significant if s.effect.happens_once]
    assert named[0] == kind

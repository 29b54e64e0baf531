"""The figures of checks, studies, deviations and comparisons."""

import math

import numpy as np
import pytest

import allanite as al
from allanite.common.units import conversion
from allanite.comparison import Drawn
from allanite.criticism import criticize
from allanite.fit.likelihood.whitened import whiten
from allanite.plots import plot_check, plot_compare, plot_deviation, plot_study, plot_time
from allanite.plots.curves import interval
from allanite.plots.spec import Bars, HeatMap, Line, Note, Points, Rule, Span
from allanite.study import Rung

pytestmark = pytest.mark.slow


def test_check_shades_what_fails_and_names_the_first_suggestion(check):
    figure = plot_check(check)
    assert check.where.worst_frequency is not None
    for panel in figure.panels[2:]:
        (span,) = panel.find(Span)
        assert (span.low, span.high) == check.where.worst_frequency
    first = check.significant[0]
    assert check.fit.display_name(first.effect) in figure.subtitle
    assert first.removes_text in figure.subtitle


def test_check_without_a_failure_shades_nothing():
    samples = np.random.default_rng(2).standard_normal(4000)
    fit = al.fit_model(al.Recording(samples, rate=10.0, unit="deg/s"), "N")
    figure = plot_check(al.Check(fit, criticize(fit, whiten(fit.solution, fit.data)), ()))
    assert not any(panel.find(Span) for panel in figure.panels)
    assert "No effect is significantly missing" in figure.subtitle


def test_study_shows_the_ladder_and_both_ends(study):
    figure = plot_study(study)
    left, allan_error, curve, density = (*figure.panels[:2], *figure.panels[-2:])
    assert [text.split("\n")[0] for _, text in left.y.ticks] == [
        "start",
        "+ Gauss-Markov process",
        "+ sinusoid",
    ]
    assert left.y.reverse
    (bars,) = left.find(Bars)
    np.testing.assert_allclose(bars.values, study.misfit_left)
    assert bars.values[0] == 100.0
    (chance,) = allan_error.find(Rule)
    assert chance.value == study.fit.error.chance_rms_percent
    # Discrepancies have a panel only if a step has one.
    discrepancies = [r.fit.discrepancy.percent for r in study.ladder]
    shown = [panel.find(Bars)[0].values for panel in figure.panels[2:-2]]
    np.testing.assert_allclose(shown, [discrepancies] if any(discrepancies) else [])
    labels = [m.label for m in curve.find(Line)]
    assert labels == [
        f"last model: {study.fit.model.name}",
        f"first model: {study.ladder[0].fit.model.name}",
    ]
    # Both models, the single frequencies around the line, and the line itself at A² T / 2.
    (line,) = [e for e in study.fit.model if e.kind == "sinusoid"]
    figure_scale = conversion(study.recording.unit, "deg/h")
    (stem,) = [m for m in density.find(Line) if m.x.size == 2]
    assert stem.x[0] == stem.x[1] == line.frequency
    assert stem.y[1] == pytest.approx(
        figure_scale**2 * line.amplitude**2 * study.fit.data.duration / 2
    )
    (single,) = [m for m in density.find(Line) if m.color == "raw"]
    assert single.x[np.argmax(single.y)] == pytest.approx(line.frequency, rel=1e-3)
    assert {"model", "c1", "raw"} == {m.color for m in density.find(Line)}


def test_study_of_one_step(fits, check):
    figure = plot_study(al.Study(fits[0].recording, (Rung(fits[0]),), check, "nothing helps"))
    # Bars would compare the step with itself.
    assert [p.title.split()[0] for p in figure.panels] == ["Allan", "Power"]
    assert not any(p.find(Bars) for p in figure.panels)
    assert "no effect added" in figure.subtitle


def test_a_removed_effect_is_a_step_of_the_ladder(fits, check):
    ladder = (Rung(fits[1]), Rung(fits[0], None, ("gauss_markov",)))
    figure = plot_study(al.Study(fits[0].recording, ladder, check, "adequate"))
    assert figure.panels[0].y.ticks[1][1] == "− Gauss-Markov process"


def test_what_took_the_place_of_another_is_a_step_too(fits, check):
    lag, line = fits[2].model.effects[-2:]
    ladder = (Rung(fits[0]), Rung(fits[2], line, ("bias_instability",), brought=(lag,)))
    study = al.Study(fits[0].recording, ladder, check, "adequate")
    figure = plot_study(study)
    assert figure.subtitle.startswith("2 effects added")
    lines = figure.panels[0].y.ticks[1][1].split("\n")
    assert lines == ["+ sinusoid", "+ Gauss-Markov process", "− bias instability"]
    assert study.rows()[1][0] == " ".join(lines)
    assert study.to_dict()["ladder"][1]["brought"] == ["gauss_markov"]


def rows(ratio):
    return [
        {
            "start_s": 10.0 * s,
            "end_s": 10.0 * s + 10.0,
            "low_hz": 0.5 * 2**b,
            "high_hz": 2.0**b,
            "ratio": ratio if (b, s) == (1, 2) else 1.0,
            "z": 9.0 if (b, s) == (1, 2) else 0.3,
        }
        for b in range(3)
        for s in range(4)
    ]


def time_check(check, cells, worst=None):
    from dataclasses import replace

    return al.Check(check.fit, replace(check.where, time=cells, worst_time=worst), ())


def test_time_map_places_each_cell(check):
    figure = plot_time(time_check(check, rows(8.0), (20.0, 30.0)))
    (heat,) = figure.panels[0].find(HeatMap)
    assert heat.values.shape == (3, 4)
    assert heat.values[1, 2] == pytest.approx(3.0)
    assert np.count_nonzero(heat.values) == 1
    assert np.argwhere(heat.marked).tolist() == [[1, 2]]
    assert "1 significant cell" in figure.subtitle
    minutes = 60.0  # the record lasts 600 s
    assert [r.value * minutes for r in figure.panels[0].find(Rule)] == pytest.approx([20.0, 30.0])


def test_time_map_of_nothing_says_so(check):
    (panel,) = plot_time(time_check(check, [])).panels
    (note,) = panel.find(Note)
    assert "too short" in note.text


def test_deviation_keeps_its_interval_and_name(fits):
    deviation = fits[0].recording.oadev()
    figure = plot_deviation(deviation, recording=fits[0].recording)
    (points,) = figure.panels[0].find(Points)
    np.testing.assert_allclose(points.low, deviation.low * np.degrees(3600.0))
    assert figure.title == "Overlapping Allan deviation"
    assert "demo.csv gyro_x · 10 min at 50 Hz" in figure.subtitle
    assert figure.panels[0].y.label == "overlapping Allan deviation (°/h)"


def curves():
    tau = np.array([1.0, 10.0, 100.0])
    flat = np.ones(3)
    return al.Curves(
        (
            Drawn("log a", "recording", "deg/s", tau, flat, 0.9 * flat, 1.1 * flat),
            Drawn("model b", "model", "rad/s", tau, flat),
            Drawn("sheet", "datasheet", "deg/s", tau, 0.5 * flat),
            Drawn("accelerometer", "recording", "mg", tau, flat, 0.9 * flat, 1.1 * flat),
        )
    )


def test_comparison_is_in_one_unit_a_panel():
    figure = plot_compare(curves())
    rates, accelerations = figure.panels
    assert rates.y.label == "Allan deviation (°/h)"
    assert accelerations.y.label == "Allan deviation (µg)"
    lines = {m.label: m for m in rates.find(Line) if m.label}
    np.testing.assert_allclose(lines["model b"].y, 3600 * 180 / np.pi)
    assert lines["sheet"].dash == "dot"
    assert [p.label for p in rates.find(Points)] == ["log a"]


def test_interval_of_many_degrees_of_freedom_is_normal():
    # s²/σ² ~ χ²/edf: the deviation's interval tends to ±1.96/√(2·edf), to order 1/edf.
    low, high = interval(np.array([1.0]), np.array([1e6]))
    assert low[0] == pytest.approx(1 - 1.959964 / math.sqrt(2e6), abs=2e-6)
    assert high[0] == pytest.approx(1 + 1.959964 / math.sqrt(2e6), abs=2e-6)

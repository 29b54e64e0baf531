"""Figures as plain data: what is drawn, where, in which unit."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al
from allanite.comparison import Curve, Curves
from allanite.criticism import criticise
from allanite.plots import (
    plot_check,
    plot_compare,
    plot_deviation,
    plot_fit,
    plot_study,
    plot_time,
)
from allanite.plots.axes import linear_axis, log_axis, score_axis
from allanite.plots.curves import interval
from allanite.plots.spec import (
    Axis,
    Band,
    Bars,
    HeatMap,
    Line,
    Note,
    Panel,
    Points,
    Rule,
    Span,
    label_of,
)
from allanite.plots.themes import COMPONENTS, theme_of
from allanite.plots.words import (
    density_unit,
    duration_text,
    in_unit,
    number,
    unit_text,
    values_text,
)
from allanite.study import Rung, Study
from allanite.suggestion import Check

RATE = 50.0


def recording(unit="rad/s"):
    """White noise with a Gauss-Markov process and a line, by code independent of the effects."""
    rng = np.random.default_rng(7)
    n = 30_000
    lag = np.zeros(n)
    phi, kicks = math.exp(-1 / (RATE * 5.0)), rng.standard_normal(n)
    for i in range(1, n):
        lag[i] = phi * lag[i - 1] + 0.004 * kicks[i]
    line = 0.02 * np.sin(2 * np.pi * 3.0 * np.arange(n) / RATE)
    samples = 0.1 * rng.standard_normal(n) + lag + line
    return al.Recording(samples, rate=RATE, unit=unit, columns=["gyro_x"], path="some/demo.csv")


@pytest.fixture(scope="module")
def fits():
    first = al.fit_model(recording(), "N+B")
    second = first.add(al.GaussMarkov(correlation_time=5.0))
    return first, second, second.add(al.Sinusoid(frequency=3.0))


@pytest.fixture(scope="module")
def check(fits):
    return fits[0].check()


@pytest.fixture(scope="module")
def study(fits, check):
    added = (None, *(f.model.effects[-1] for f in fits[1:]))
    ladder = tuple(Rung(f, a) for f, a in zip(fits, added, strict=True))
    return Study(fits[0].recording, ladder, check, "nothing helps")


@pytest.fixture(scope="module")
def figures(fits, check, study):
    return {
        "fit": plot_fit(fits[2]),
        "check": plot_check(check),
        "study": plot_study(study),
        "time": plot_time(check),
        "deviation": plot_deviation(fits[0].recording.oadev()),
    }


def marks(panel, kind, color=None):
    return [m for m in panel.find(kind) if color in (None, m.color)]


def test_fit_shows_measured_model_band_and_every_effect(fits):
    fit = fits[2]
    figure = plot_fit(fit)
    allan = figure.panels[0]
    (measured,) = marks(allan, Points, "measured")
    np.testing.assert_array_equal(measured.x, fit.curve.tau)
    np.testing.assert_array_equal(measured.y, fit.curve.measured)
    assert np.all(measured.low < measured.y)
    assert np.all(measured.y < measured.high)
    (model,) = marks(allan, Line, "model")
    np.testing.assert_array_equal(model.y, fit.curve.model)
    everywhere, band = allan.find(Band)
    np.testing.assert_array_equal(band.low, fit.band.low)
    assert np.all(everywhere.low < band.low)
    assert np.all(everywhere.high > band.high)
    effects = [m for m in allan.find(Line) if m.color in COMPONENTS]
    assert [m.label.split(":")[0] for m in effects] == [
        "angle random walk",
        "bias instability",
        "Gauss-Markov process",
        "sinusoid",
    ]
    assert len({m.color for m in effects}) == 4


def test_fit_strips_share_the_axis_and_hold_the_residuals(fits):
    figure = plot_fit(fits[0])
    allan, below, spectrum, under = figure.panels
    assert (allan.row, below.row, spectrum.row, under.row) == (0, 1, 0, 1)
    assert below.x == allan.x
    assert under.x == spectrum.x
    (points,) = below.find(Points)
    np.testing.assert_array_equal(points.y, fits[0].curve.z)
    assert sorted(r.value for r in below.find(Rule)) == [-3.5, -2.0, 0.0, 2.0, 3.5]
    assert below.y.low == -below.y.high


def test_spectrum_is_two_sided_in_units_per_hertz(fits):
    # White noise of 0.1 per sample at 50 Hz: 0.1² / 50 = 2e-4 at high frequency.
    spectrum = plot_fit(fits[0]).panels[2]
    (points,) = marks(spectrum, Points, "measured")
    # About 15 000 ordinates above 10 Hz: the mean is known to √(2/15 000) ≈ 1.2 %; 4 of these.
    assert np.mean(points.y[points.x > 10.0]) == pytest.approx(2e-4, rel=0.05)
    assert "(rad/s)²/Hz" in spectrum.y.label
    assert points.x[-1] == pytest.approx(RATE / 2, rel=0.1)


def test_spectrum_components_add_up_to_the_model(fits):
    spectrum = plot_fit(fits[1]).panels[2]
    (model,) = marks(spectrum, Line, "model")
    total = sum(m.y for m in spectrum.find(Line) if m.color in COMPONENTS)
    np.testing.assert_allclose(total, model.y, rtol=1e-9)


def test_a_line_is_marked_at_its_frequency_and_shown_before_it_was_taken_out(fits):
    spectrum = plot_fit(fits[2]).panels[2]
    (rule,) = [r for r in spectrum.find(Rule) if r.axis == "x"]
    assert rule.value == pytest.approx(3.0, abs=0.01)
    (raw,) = marks(spectrum, Points, "raw")
    assert np.any(np.abs(np.log(raw.x / 3.0)) < 0.1)
    assert spectrum.y.high > raw.y.max()


def test_check_shades_what_fails_and_names_the_first_suggestion(check):
    figure = plot_check(check)
    assert check.where.worst_frequency is not None
    for panel in figure.panels[2:]:
        (span,) = panel.find(Span)
        assert (span.low, span.high) == check.where.worst_frequency
    first = check.significant[0]
    assert check.fit.display_name(first.effect) in figure.subtitle
    assert f"{first.removes_percent:.0f} %" in figure.subtitle


def test_check_without_a_failure_shades_nothing():
    samples = np.random.default_rng(2).standard_normal(4000)
    fit = al.fit_model(al.Recording(samples, rate=10.0, unit="deg/s"), "N")
    figure = plot_check(Check(fit, criticise(fit), ()))
    assert not any(panel.find(Span) for panel in figure.panels)
    assert "Nothing is significantly missing" in figure.subtitle


def test_study_shows_the_ladder_and_both_ends(study):
    figure = plot_study(study)
    chi, allan_error, held, curve = figure.panels
    assert [text.split("\n")[0] for _, text in chi.y.ticks] == [
        "start",
        "+ Gauss-Markov process",
        "+ sinusoid",
    ]
    assert chi.y.reverse
    (bars,) = chi.find(Bars)
    np.testing.assert_allclose(bars.values, [r.fit.misfit.reduced for r in study.ladder])
    (chance,) = allan_error.find(Rule)
    assert chance.value == study.fit.error.chance_rms_percent
    assert held.find(Bars)[0].values[0] == study.ladder[0].fit.error.held_out
    labels = [m.label for m in curve.find(Line)]
    assert labels == [
        f"first model: {study.ladder[0].fit.model.name}",
        f"last model: {study.fit.model.name}",
    ]


def test_study_of_one_rung(fits, check):
    figure = plot_study(Study(fits[0].recording, (Rung(fits[0]),), check, "nothing helps"))
    assert figure.panels[0].find(Bars)[0].values.shape == (1,)
    assert "no effect added" in figure.subtitle


def test_a_removed_effect_is_a_step_of_the_ladder(fits, check):
    ladder = (Rung(fits[1]), Rung(fits[0], None, ("gauss_markov",)))
    figure = plot_study(Study(fits[0].recording, ladder, check, "adequate"))
    assert figure.panels[0].y.ticks[1][1] == "− gauss markov"


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

    return Check(check.fit, replace(check.where, time=cells, worst_time=worst), ())


def test_time_map_places_each_cell(check):
    figure = plot_time(time_check(check, rows(8.0), (20.0, 30.0)))
    (heat,) = figure.panels[0].find(HeatMap)
    assert heat.values.shape == (3, 4)
    assert heat.values[1, 2] == pytest.approx(3.0)
    assert np.count_nonzero(heat.values) == 1
    assert np.argwhere(heat.marked).tolist() == [[1, 2]]
    assert "1 cell beyond chance" in figure.subtitle
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
    np.testing.assert_array_equal(points.low, deviation.low)
    assert figure.title == "Overlapping Allan deviation"
    assert "demo.csv gyro_x · 10 min at 50 Hz" in figure.subtitle
    assert figure.panels[0].y.label == "overlapping Allan deviation (rad/s)"


def curves():
    tau = np.array([1.0, 10.0, 100.0])
    flat = np.ones(3)
    return Curves(
        (
            Curve("log a", "recording", "deg/s", tau, flat, 0.9 * flat, 1.1 * flat),
            Curve("model b", "model", "rad/s", tau, flat),
            Curve("sheet", "datasheet", "deg/s", tau, 0.5 * flat),
            Curve("accelerometer", "recording", "mg", tau, flat, 0.9 * flat, 1.1 * flat),
        )
    )


def test_comparison_is_in_one_unit_a_panel():
    figure = plot_compare(curves())
    rates, accelerations = figure.panels
    assert rates.y.label == "Allan deviation (°/s)"
    assert accelerations.y.label == "Allan deviation (mg)"
    lines = {m.label: m for m in rates.find(Line) if m.label}
    np.testing.assert_allclose(lines["model b (model, from rad/s)"].y, 180 / np.pi)
    assert lines["sheet (datasheet)"].dash == "dot"
    assert [p.label for p in rates.find(Points)] == ["log a (recording)"]


def test_interval_of_many_degrees_of_freedom_is_normal():
    # s²/σ² ~ χ²/edf: the deviation's interval tends to ±1.96/√(2·edf), to order 1/edf.
    low, high = interval(np.array([1.0]), np.array([1e6]))
    assert low[0] == pytest.approx(1 - 1.959964 / math.sqrt(2e6), abs=2e-6)
    assert high[0] == pytest.approx(1 + 1.959964 / math.sqrt(2e6), abs=2e-6)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", ["fit", "check", "study", "time", "deviation"])
def test_plotly_document_is_plain_and_complete(figures, name, theme):
    figure = figures[name]
    document = figure.to_plotly(theme)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    axes = [key for key in document["layout"] if key.startswith("xaxis")]
    assert len(axes) == len(figure.panels)
    shown = [t["name"] for t in document["data"] if t.get("showlegend")]
    assert sorted(shown) == sorted(label_of(m) for m in figure.legend())
    for key in axes:
        low, high = document["layout"][key]["domain"]
        assert 0.0 <= low < high <= 1.0 + 1e-12


def test_plotly_log_range_and_linked_strips(figures):
    figure = figures["fit"]
    layout = figure.to_plotly()["layout"]
    assert layout["xaxis"]["range"] == pytest.approx(
        [math.log10(figure.panels[0].x.low), math.log10(figure.panels[0].x.high)]
    )
    assert layout["xaxis2"]["matches"] == "x"
    assert layout["xaxis4"]["matches"] == "x3"
    assert layout["yaxis2"]["domain"][1] < layout["yaxis"]["domain"][0]


def test_plotly_accepts_the_document(figures):
    graph_objects = pytest.importorskip("plotly.graph_objects")
    for figure in figures.values():
        graph_objects.Figure(figure.to_plotly())


@pytest.mark.parametrize(
    ("unit", "printed"),
    [
        ("rad/s", "rad/s"),
        ("deg/s", "°/s"),
        ("deg/h", "°/h"),
        ("m/s^2", "m/s²"),
        ("ug", "µg"),
        ("mdeg/s", "m°/s"),
        ("rad/s·s^½", "rad/√s"),
        ("rad/s/s^½", "rad/s/√s"),
        ("deg/s·s", "°"),
        ("rad/s/s", "rad/s²"),
        ("m/s^2·s^½", "m/s/√s"),
        ("mg·s^½", "mg·√s"),
        ("deg/h·s^½", "°/h·√s"),
        ("deg/h/s^½", "°/h/√s"),
    ],
)
def test_units_as_printed(unit, printed):
    assert unit_text(unit) == printed
    # What is printed means the same: the parser of units reads it back.
    from allanite.units import conversion

    assert conversion(unit, printed) == pytest.approx(1.0)


def test_densities_and_axis_labels():
    assert density_unit("deg/s") == "(°/s)²/Hz"
    assert density_unit("mg") == "mg²/Hz"
    assert density_unit("1") == "1/Hz"
    assert in_unit("Allan deviation", "1") == "Allan deviation"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0126, "0.0126"), (1.9e-5, "1.9·10⁻⁵"), (12345.0, "12300"), (-2.0, "−2"), (1e-7, "10⁻⁷")],
)
def test_numbers(value, text):
    assert number(value) == text


def test_durations():
    assert [duration_text(s) for s in (40.0, 600.0, 7200.0, 3 * 86400.0)] == [
        "40 s",
        "10 min",
        "2 h",
        "3 d",
    ]


@given(st.floats(-12, 9), st.floats(0, 14))
def test_log_axis_always_has_readable_ticks(exponent, decades):
    low = 10.0**exponent
    high = low * 10.0**decades
    axis = log_axis("x", [low, high])
    assert axis.low < low
    assert axis.high > high
    assert 1 <= len(axis.ticks) <= 9
    assert all(axis.low <= v <= axis.high for v, _ in axis.ticks)
    texts = [t for _, t in axis.ticks]
    assert len(set(texts)) == len(texts)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_linear_axis_always_has_a_few_ticks(low, width):
    axis = linear_axis("x", low, low + width)
    assert 2 <= len(axis.ticks) <= 8
    tolerance = 1e-6 * (abs(low) + width)
    assert all(low - tolerance <= v <= low + width + tolerance for v, _ in axis.ticks)


@given(st.lists(st.floats(-1e4, 1e4), max_size=20))
def test_score_axis_contains_every_score_and_both_guides(scores):
    axis = score_axis("σ", scores)
    assert axis.high > max([4.5, *(abs(s) for s in scores)])
    assert axis.ticks[0][0] == -axis.ticks[-1][0]
    assert axis.ticks[-1][0] < axis.high


def test_wrong_data_are_refused():
    with pytest.raises(al.InputError, match="differ in length"):
        Line([1.0, 2.0], [1.0], "c1")
    with pytest.raises(al.InputError, match="logarithmic"):
        Axis("x", 0.0, 1.0, log=True)
    with pytest.raises(al.InputError, match="limits"):
        Axis("x", 2.0, 1.0)
    with pytest.raises(al.InputError, match="texts"):
        Bars([1.0, 2.0], ("1",), ("c1", "c1"))
    with pytest.raises(al.InputError, match="theme"):
        theme_of("blue")


def test_data_are_read_only():
    line = Line([1.0, 2.0], [1.0, 2.0], "c1")
    with pytest.raises(ValueError, match="read-only"):
        line.x[0] = 5.0


def luminance(color):
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("name", ["light", "dark"])
def test_words_are_readable_on_their_ground(name):
    # WCAG 2: 4.5 for text, 3 for what is not text; Okabe and Ito's lighter hues are lines beside a legend.
    theme = theme_of(name)

    def contrast(color):
        pair = sorted((luminance(color), luminance(theme.panel)))
        return (pair[1] + 0.05) / (pair[0] + 0.05)

    assert contrast(theme.text) > 10
    assert contrast(theme.faint) > 4.5
    assert contrast(theme.color("model")) > 3
    assert all(contrast(theme.color(c)) > 2.2 for c in COMPONENTS)


def test_panels_find_marks_by_kind():
    axis = Axis("x", 0.0, 1.0)
    panel = Panel(axis, axis, (Span(0.1, 0.2, "fail"), Note(0.5, 0.5, "words")))
    assert len(panel.find(Span)) == 1
    assert panel.find(Line) == ()


def test_legend_gives_the_values_that_say_most():
    def estimate(value, unit, interval=None, detected=True):
        return al.Estimate(value, None, interval, unit, detected)

    lag = {"correlation_time": estimate(30.0, "s"), "q_c": estimate(0.002, "rad/s/s^½")}
    assert values_text(lag | {"sigma": estimate(0.0077, "rad/s")}) == "σ 0.0077 rad/s, T 30 s"
    nothing = estimate(0.0, "rad/s/s^½", (0.0, 0.001), detected=False)
    assert values_text(lag | {"q_c": nothing, "sigma": estimate(0.0, "rad/s")}).startswith("q_c < ")
    line = {
        "frequency": estimate(3.0, "Hz", (2.9, 3.1), detected=False),
        "amplitude": estimate(0.1, "deg/s", (0.0, 0.2), detected=False),
    }
    assert values_text(line) == "f 3 Hz, a < 0.2 °/s"


def test_a_covariate_is_named_by_its_column():
    rng = np.random.default_rng(4)
    temperature = 20.0 + np.cumsum(rng.standard_normal(4000)) * 0.01
    samples = rng.standard_normal(4000) + 5.0 * temperature
    log = al.Recording(samples, rate=10.0, unit="mg", covariates={"temperature": temperature})
    figure = plot_fit(al.fit_model(log, "N+COV(column=temperature)"))
    labels = [label_of(m) for m in figure.legend()]
    assert any("temperature: c " in label for label in labels)


def test_the_shortest_record_has_a_figure():
    samples = np.random.default_rng(5).standard_normal(40)
    figure = plot_fit(al.fit_model(al.Recording(samples, rate=1.0, unit="1"), "N"))
    spectrum = figure.panels[2]
    (points,) = marks(spectrum, Points, "measured")
    assert np.all((spectrum.y.low < points.y) & (points.y < spectrum.y.high))
    # The interval of the best known point is seen whole.
    best = np.argmin(points.high / points.low)
    assert spectrum.y.low < points.low[best]
    assert points.high[best] < spectrum.y.high

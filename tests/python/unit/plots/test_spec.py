"""Axes, marks and themes: what a figure is made of."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import allanite as al
from allanite.plots.axes import linear_axis, log_axis, score_axis
from allanite.plots.spec import Axis, Bars, Line, Note, Panel, Span
from allanite.plots.themes import COMPONENTS, theme_of


@given(st.floats(-12, 9), st.floats(0, 14))
@example(1.375, 0.25)  # between 20 and 50
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

"""Figures for paper and slides, and the stability of a clock with its table."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest

import allanite as al
from allanite.common.numbers import number
from allanite.plots import plot_stability
from allanite.plots.axes import log_axis
from allanite.plots.spec import Figure, Line, Note, Panel, Points, Span

pytest.importorskip("matplotlib")

WHITE_PHASE = np.random.default_rng(4).standard_normal(5000) * 1e-10


def drawn(figure, style):
    from allanite.plots.matplotlib_painter import draw

    return draw(figure, style=style)


def texts(canvas):
    from matplotlib.text import Text

    return [t for t in canvas.findobj(Text) if t.get_text()]


@pytest.mark.slow
def test_paper_is_one_column_of_8_points_without_a_title(fits):
    figure = fits[0].plot()
    canvas = drawn(figure, "paper")
    assert canvas.get_size_inches()[0] == pytest.approx(88 / 25.4)
    assert {t.get_fontsize() for t in texts(canvas)} == {8.0}
    words = " ".join(t.get_text() for t in texts(canvas))
    assert figure.title not in words
    # Curve, its strip, spectrum, its strip: below each other, all as wide.
    canvas.draw_without_rendering()
    boxes = [axes.get_position() for axes in canvas.axes]
    assert len(boxes) == 4
    assert all(a.y0 > b.y0 for a, b in itertools.pairwise(boxes))
    assert max(b.x0 for b in boxes) - min(b.x0 for b in boxes) < 0.01


def test_slides_have_large_letters_and_keep_the_title(fits):
    canvas = drawn(fits[0].plot(), "slides")
    assert min(t.get_fontsize() for t in texts(canvas)) >= 18
    assert any(t.get_weight() == "bold" for t in texts(canvas))


@pytest.mark.parametrize("style", ["screen", "paper", "slides"])
@pytest.mark.parametrize("place", [0.02, 0.3, 1.0, 3.0, 50.0])
def test_texts_of_ranges_stay_inside_of_their_panel_and_apart(style, place):
    x, y = log_axis("f (Hz)", [0.01, 100.0]), log_axis("density", [1.0, 10.0])
    words = ("2.03 × the model at 1.69 Hz", "1.5 × the model")
    spans = tuple(Span(place, 1.01 * place, "fail", "", text) for text in words)
    panels = tuple(Panel(x, y, spans, column=column) for column in (0, 1))
    canvas = drawn(Figure("", "", panels, widths=(1.0, 1.0)), style)
    canvas.draw_without_rendering()
    for axes in canvas.axes:
        frame = axes.get_window_extent()
        boxes = [t.get_window_extent() for t in axes.texts]
        assert len(boxes) == 2
        # A box has a margin of some pixels around the letters.
        assert all(b.x0 > frame.x0 - 3.0 and b.x1 < frame.x1 + 3.0 for b in boxes)
        assert not boxes[0].overlaps(boxes[1])


def outside(canvas):
    """Texts that leave the canvas, and pairs of labels of axes that meet."""
    canvas.draw_without_rendering()
    whole = canvas.bbox
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts(canvas) if t.get_visible()]
    found = [
        text for text, b in boxes if b.x0 < 0 or b.x1 > whole.x1 or b.y0 < 0 or b.y1 > whole.y1
    ]
    labels = [axes.yaxis.label.get_window_extent() for axes in canvas.axes]
    return found + [a for a, b in itertools.combinations(labels, 2) if a.overlaps(b)]


@pytest.mark.parametrize("style", ["screen", "paper", "slides"])
def test_no_words_leave_a_figure_or_meet(fits, style):
    figure = fits[2].plot()
    assert outside(drawn(figure, style)) == []
    long = replace(figure, title=" · ".join([figure.title] * 3))
    assert outside(drawn(long, style)) == []


@pytest.mark.parametrize("style", ["screen", "paper", "slides"])
def test_no_table_leaves_its_figure(clock, style):
    kinds = [getattr(al, kind)(clock).at_confidence(0.683) for kind in ("oadev", "mdev", "hdev")]
    figure = plot_stability(kinds)
    assert outside(drawn(figure, style)) == []
    table = "".join(t.get_text() for t in drawn(figure, style).texts if "τ (s)" in t.get_text())
    # Slides have no table; paper has one for each deviation.
    assert table.count("τ (s)") == {"screen": 1, "paper": 3, "slides": 0}[style]
    assert all(d.kind in table for d in kinds) is (style != "slides")


def test_an_unknown_style_is_refused(fits, tmp_path):
    with pytest.raises(al.InputError, match="screen, paper, slides"):
        fits[0].plot().save(tmp_path / "x.svg", style="poster")


@pytest.fixture
def clock():
    return al.Recording(WHITE_PHASE, 1.0, unit="1", quantity="angle", columns=["phase"])


def test_stability_of_a_clock_has_guides_and_a_table(clock):
    kinds = [getattr(al, kind)(clock).at_confidence(0.683) for kind in ("oadev", "mdev")]
    figure = plot_stability(kinds)
    (panel,) = figure.panels
    assert panel.y.label == "σ_y(τ)"
    assert [p.label for p in panel.find(Points)] == [
        "σ_y(τ) OADEV ± 68.3 %",
        "Mod σ_y(τ) MDEV ± 68.3 %",
    ]
    assert [n.text for n in panel.find(Note)] == ["τ⁻¹", "τ⁻¹ᐟ²", "τ¹ᐟ²"]
    slopes = [
        float(np.diff(np.log(line.y))[0] / np.diff(np.log(line.x))[0])
        for line in panel.find(Line)
        if line.dash == "dot"
    ]
    np.testing.assert_allclose(slopes, [-1, -0.5, 0.5])
    head, first, *_ = figure.below.splitlines()
    assert head.split()[:3] == ["τ", "(s)", "oadev"]
    assert first.split()[1] == number(kinds[0].deviation[0], 4)
    assert kinds[0].to_dict()["confidence"] == 0.683


def test_labels_of_guides_are_apart_from_intervals(clock):
    kinds = [getattr(al, kind)(clock) for kind in ("oadev", "mdev")]
    figure = plot_stability(kinds)
    canvas = drawn(figure, "paper")
    canvas.draw_without_rendering()
    (axes,) = canvas.axes
    (panel,) = figure.panels
    names = [n.text for n in panel.find(Note)]
    boxes = [t.get_window_extent() for t in axes.texts if t.get_text() in names]
    assert len(boxes) == 3
    for points in panel.find(Points):
        for tau, low, high in zip(points.x, points.low, points.high, strict=True):
            (x, bottom), (_, top) = axes.transData.transform([(tau, low), (tau, high)])
            assert not any(b.x0 < x < b.x1 and bottom < b.y1 and top > b.y0 for b in boxes)


def test_a_narrower_confidence_is_a_narrower_interval(clock):
    wide, narrow = al.oadev(clock), al.oadev(clock).at_confidence(0.683)
    # Of many degrees of freedom the ends are normal: 1.96 standard deviations against 1.
    ratio = np.log(wide.high[0] / wide.low[0]) / np.log(narrow.high[0] / narrow.low[0])
    assert ratio == pytest.approx(1.96, rel=0.01)
    assert "68.3 % interval" in str(narrow)
    assert "confidence" not in wide.to_dict()
    with pytest.raises(al.InputError, match="between 0 and 1"):
        wide.at_confidence(95.0)


def test_compared_logs_of_two_rates_have_ratios_with_intervals():
    slow = al.AngleRandomWalk(N=0.02).simulate(n=4000, rate=7.0, seed=1, unit="deg/s")
    fast = al.AngleRandomWalk(N=0.01).simulate(n=40_000, rate=100.0, seed=2, unit="deg/s")
    rows = str(al.compare([("slow", slow, None), ("fast", fast, None)])).splitlines()
    row = next(r for r in rows if "(" in r and "…" in r)
    ratio, low, high = map(float, re.search(r"([\d.]+) \(([\d.]+) … ([\d.]+)\)", row).groups())
    assert low < 0.5 < high
    assert ratio == pytest.approx(0.5, rel=0.1)
    # Both logs count: the interval is wider than that of either alone.
    alone = al.oadev(slow)
    assert high / low > float(alone.high[0] / alone.low[0])

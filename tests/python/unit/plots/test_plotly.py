"""Figures as documents for plotly: plain, complete, axes linked."""

import html
import json
import math

import pytest

from allanite.plots.axes import log_axis
from allanite.plots.spec import Figure, Panel, Span, label_of


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", ["fit", "check", "study", "time", "deviation"])
def test_plotly_document_is_plain_and_complete(figures, name, theme):
    figure = figures[name]
    document = figure.to_plotly(theme)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    axes = [key for key in document["layout"] if key.startswith("xaxis")]
    assert len(axes) == len(figure.panels)
    # plotly reads names as HTML ("B < 0.015 rad/s").
    names = [t["name"] for t in document["data"] if t.get("showlegend")]
    shown = [html.unescape(name) for name in names]
    assert names == [html.escape(name, quote=False) for name in shown]
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


def test_words_of_neighboring_ranges_do_not_cover_each_other():
    x, y = log_axis("τ (s)", [0.01, 100.0]), log_axis("σ", [1.0, 10.0])
    spans = (Span(0.1, 0.2, "fail", "", "×1.4"), Span(0.22, 0.3, "fail", "", "×1.1"))
    found = Figure("", "", (Panel(x, y, spans),)).to_plotly()["layout"]["annotations"]
    assert [a["text"] for a in found] == ["<b>×1.4</b>", "<b>×1.1</b>"]
    assert found[0]["yshift"] - found[1]["yshift"] >= 16

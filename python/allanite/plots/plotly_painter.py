"""Conversion of figures to plotly's JSON format, without the plotly package."""

from __future__ import annotations

import math
from html import escape
from typing import Any

import numpy as np

from allanite.common.numbers import number
from allanite.plots.spec import (
    Axis,
    Band,
    Bars,
    Figure,
    HeatMap,
    Line,
    Mark,
    Note,
    Panel,
    Points,
    Rule,
    Span,
    text_anchor,
)
from allanite.plots.themes import Theme, theme_of

FONT = "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif"
#: Gaps between columns, and between rows, of the grid, as fractions of the figure.
GAP_X, GAP_Y = 0.075, 0.03
#: Assumed width of the text of a shaded range relative to its panel, whose size in pixels is not known.
SPAN_TEXT_WIDTH = 0.3
#: Gap below rows that have tick texts and an axis label.
GAP_BELOW_LABEL = 0.17


def paint(figure: Figure, theme: str = "light") -> dict[str, Any]:
    """Arguments ``{"data": […], "layout": {…}}`` of ``Plotly.newPlot``: plain numbers, lists and texts.

    NaN is replaced by None.
    """
    look = theme_of(theme)
    layout: dict[str, Any] = {
        "paper_bgcolor": look.ground,
        "plot_bgcolor": look.panel,
        "font": {"family": FONT, "size": 12, "color": look.text},
        "margin": {"l": 70, "r": 20, "t": 90, "b": 120},
        "legend": {"orientation": "h", "x": 0, "y": -0.14, "yanchor": "top", "font": {"size": 11}},
        "hovermode": "closest",
        "title": _plotly_title(figure, look),
        "shapes": [],
        "annotations": [],
    }
    data: list[dict[str, Any]] = []
    # The gap before a column without tick texts is smaller.
    bare = frozenset(panel.column for panel in figure.panels if not panel.show_y)
    for count, panel in enumerate(figure.panels, 1):
        suffix = "" if count == 1 else str(count)
        across = _grid_domain(figure.widths, panel.column, 1, GAP_X, bare)
        down = _grid_domain(figure.heights, panel.row, panel.rows, _row_gap(figure))
        upright = [1.0 - down[1], 1.0 - down[0]]
        layout[f"xaxis{suffix}"] = _plotly_axis(
            panel.x, panel, across, f"y{suffix}", panel.show_x, look
        )
        layout[f"yaxis{suffix}"] = _plotly_axis(
            panel.y, panel, upright, f"x{suffix}", panel.show_y, look
        )
        partner = _matching_axis(figure, panel)
        if partner is not None:
            layout[f"xaxis{suffix}"]["matches"] = partner
        if panel.title:
            layout["annotations"].append(
                {
                    "text": f"<b>{html_text(panel.title)}</b>",
                    "x": across[0],
                    "y": upright[1],
                    "xref": "paper",
                    "yref": "paper",
                    "xanchor": "left",
                    "yanchor": "bottom",
                    "showarrow": False,
                }
            )
        painter = _PanelPainter(data, layout, look, suffix)
        for mark in panel.marks:
            painter.add_mark(mark)
    _show_labels_once(data)
    return {"data": data, "layout": layout}


def _plotly_title(figure: Figure, look: Theme) -> dict[str, Any]:
    """Dict: plotly title with title and subtitle of a figure; without a subtitle only the title."""
    rest = html_text(figure.subtitle)
    text = f"<b>{html_text(figure.title)}</b>" + (
        f"<br><span style='font-size:12px'>{rest}</span>" if rest else ""
    )
    return {
        "text": text,
        "x": 0.01,
        "xanchor": "left",
        "y": 0.98,
        "yanchor": "top",
        "font": {"size": 15, "color": look.text},
    }


def _row_gap(figure: Figure) -> float:
    """Gap between rows as a fraction of the figure: 0.17 if panels above the last row have tick texts, else 0.03."""
    labeled = any(p.show_x and p.row + p.rows < len(figure.heights) for p in figure.panels)
    return GAP_BELOW_LABEL if labeled else GAP_Y


def _grid_domain(
    sizes: tuple[float, ...], place: int, span: int, gap: float, bare: frozenset[int] = frozenset()
) -> list[float]:
    """[start, end] of a panel, as fractions 0 … 1 of the figure, along its rows or columns of relative `sizes`.

    The panel covers `span` rows or columns from index `place` on. The gap between two of them is `gap`, and a quarter
    of it before a column in `bare`.
    """
    gaps = [0.25 * gap if i + 1 in bare else gap for i in range(len(sizes) - 1)]
    unit = (1.0 - sum(gaps)) / sum(sizes)
    start = sum(s * unit for s in sizes[:place]) + sum(gaps[:place])
    inside = sizes[place : place + span]
    return [start, start + sum(s * unit for s in inside) + sum(gaps[place : place + span - 1])]


def _matching_axis(figure: Figure, panel: Panel) -> str | None:
    """Name of the x axis (``x``, ``x2``, …) of the first panel above with an equal x axis, or None."""
    for count, other in enumerate(figure.panels, 1):
        if other is not panel and other.column == panel.column and other.x == panel.x:
            return None if other.row > panel.row else ("x" if count == 1 else f"x{count}")
    return None


def _plotly_axis(
    axis: Axis, panel: Panel, domain: list[float], anchor: str, show: bool, look: Theme
) -> dict[str, Any]:
    """Plotly layout of one axis; `anchor` is the name of the crossing axis. Without `show`, it has no texts."""
    ends = [math.log10(axis.low), math.log10(axis.high)] if axis.log else [axis.low, axis.high]
    return {
        "type": "log" if axis.log else "linear",
        "domain": domain,
        "anchor": anchor,
        "range": ends[::-1] if axis.reverse else ends,
        "tickmode": "array",
        "tickvals": [v for v, _ in axis.ticks],
        "ticktext": [html_text(t) for _, t in axis.ticks],
        "showticklabels": show,
        "title": {"text": html_text(axis.label) if show else "", "standoff": 8},
        "showgrid": panel.grid,
        "gridcolor": look.grid,
        "linecolor": look.faint,
        "showline": True,
        "ticks": "outside",
        "tickcolor": look.faint,
        "zeroline": False,
        "automargin": True,
    }


def html_text(text: str) -> str:
    """Text escaped for HTML, with line breaks, as plotly expects."""
    return escape(text, quote=False).replace("\n", "<br>")


def _finite_or_none(values: Any) -> list[float | None]:
    """List of floats of a one-dimensional array, with None for values that are not finite."""
    return [float(v) if math.isfinite(v) else None for v in np.asarray(values, dtype=float)]


def _rgba(color: str, alpha: float) -> str:
    """CSS text ``rgba(…)`` of a hexadecimal color with an opacity."""
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


class _PanelPainter:
    """Adds the marks of one panel to the traces `data` and the `layout` of a plotly document, in place.

    Ranges and rules are shapes; an empty trace makes their legend entry.
    """

    def __init__(
        self, data: list[dict[str, Any]], layout: dict[str, Any], look: Theme, suffix: str
    ) -> None:
        self.data, self.layout, self.look = data, layout, look
        self.x, self.y, self.suffix = f"x{suffix}", f"y{suffix}", suffix

    def add_mark(self, mark: Mark) -> None:
        """Add the traces, shapes and annotations of a mark of any kind."""
        match mark:
            case Line():
                self.add_scatter(
                    mark.x, mark.y, mark.label, mode="lines", line=self.line_style(mark)
                )
            case Points():
                self.add_points(mark)
            case Band():
                fill = _rgba(self.look.color(mark.color), mark.opacity)
                area = {"line": {"width": 0}, "fill": "toself", "fillcolor": fill}
                x, y = _band_outline(mark)
                self.add_scatter(x, y, mark.label, mode="lines", hoverinfo="skip", **area)
            case Span():
                self.add_span(mark)
            case Rule():
                self.add_rule(mark)
            case Bars():
                self.add_bars(mark)
            case HeatMap():
                self.add_heat_map(mark)
            case Note():
                self.layout["annotations"].append(
                    {
                        "text": html_text(mark.text),
                        "x": mark.x,
                        "y": mark.y,
                        "xref": f"{self.x} domain",
                        "yref": f"{self.y} domain",
                        "showarrow": False,
                        "font": {"color": self.look.color(mark.color), "size": 14},
                    }
                )

    def line_style(self, mark: Line | Rule) -> dict[str, Any]:
        """Dict of the color, width and dash style of a line or rule."""
        return {"color": self.look.color(mark.color), "width": mark.width, "dash": mark.dash}

    def add_scatter(self, x: Any, y: Any, label: str, **style: Any) -> None:
        """Add a scatter trace; with a label, it has a legend entry. Numbers that are not finite become None."""
        trace = {
            "type": "scatter",
            "x": _finite_or_none(x),
            "y": _finite_or_none(y),
            "name": html_text(label),
            "showlegend": bool(label),
            **({"legendgroup": html_text(label)} if label else {}),
        }
        self.data.append(trace | {"xaxis": self.x, "yaxis": self.y} | style)

    def add_shape(self, x0: float, x1: float, y0: float, y1: float, **style: Any) -> None:
        """Add a shape between two values of the x axis and two of the y axis."""
        ends = {"x0": x0, "x1": x1, "y0": y0, "y1": y1}
        self.layout["shapes"].append({"xref": self.x, "yref": self.y, **ends, **style})

    def add_points(self, mark: Points) -> None:
        """Add markers, open if hollow, with error bars if the points have both ends."""
        color = self.look.color(mark.color)
        style: dict[str, Any] = {
            "mode": "markers",
            "marker": {
                "color": color,
                "size": 1.5 * mark.size,
                "symbol": "circle-open" if mark.hollow else "circle",
            },
        }
        if mark.low is not None and mark.high is not None:
            style["error_y"] = {
                "type": "data",
                "symmetric": False,
                "array": _finite_or_none(mark.high - mark.y),
                "arrayminus": _finite_or_none(mark.y - mark.low),
                "color": color,
                "thickness": 1,
                "width": 0,
            }
        self.add_scatter(mark.x, mark.y, mark.label, **style)

    def add_span(self, mark: Span) -> None:
        """Add a shaded range with its text and its legend entry."""
        color = self.look.color(mark.color)
        fill = _rgba(color, 0.25)
        # Edges keep a range visible that is narrower than a pixel.
        edge = {"width": 1, "color": _rgba(color, 1.0)}
        style = {"yref": f"{self.y} domain", "layer": "below", "fillcolor": fill, "line": edge}
        self.add_shape(mark.low, mark.high, 0, 1, type="rect", **style)
        if mark.text:
            self.add_span_text(mark)
        marker = {"symbol": "square", "size": 12, "color": fill}
        self.add_scatter([None], [None], mark.label, mode="markers", marker=marker)

    def add_span_text(self, mark: Span) -> None:
        """Add the text of a shaded range at the upper edge, inside the x axis and below earlier texts."""
        axis = self.layout[f"xaxis{self.suffix}"]
        first, last = sorted(axis["range"])
        ends = [math.log10(v) if axis["type"] == "log" else v for v in (mark.low, mark.high)]
        middle = 0.5 * (max(ends[0], first) + min(ends[1], last))
        place, side = text_anchor((middle - first) / (last - first), SPAN_TEXT_WIDTH)
        # Each text is below the previous one, because neighboring ranges are narrower than their texts.
        annotations = self.layout["annotations"]
        before = [a for a in annotations if (a.get("name"), a["xref"]) == ("span", self.x)]
        annotations.append(
            {
                "text": f"<b>{html_text(mark.text)}</b>",
                "x": first + place * (last - first),
                "y": 1.0,
                "xref": self.x,
                "yref": f"{self.y} domain",
                "xanchor": side,
                "yanchor": "top",
                "yshift": -18 * len(before),
                "showarrow": False,
                "font": {"size": 12, "color": self.look.text},
                "bgcolor": _rgba(self.look.panel, 0.8),
                "name": "span",
            }
        )

    def add_rule(self, mark: Rule) -> None:
        """Add a straight line across the panel, with a legend entry if it has a label."""
        style = {"type": "line", "layer": "below", "line": self.line_style(mark)}
        if mark.axis == "x":
            self.add_shape(mark.value, mark.value, 0, 1, yref=f"{self.y} domain", **style)
        else:
            self.add_shape(0, 1, mark.value, mark.value, xref=f"{self.x} domain", **style)
        if mark.label:
            line = self.line_style(mark)
            self.add_scatter([None], [None], mark.label, mode="lines", line=line)

    def add_bars(self, mark: Bars) -> None:
        """Add horizontal bars with their texts."""
        self.data.append(
            {
                "type": "bar",
                "orientation": "h",
                "x": _finite_or_none(mark.values),
                "y": list(range(mark.values.size)),
                "text": [html_text(text) for text in mark.texts],
                "textposition": "outside",
                "cliponaxis": False,
                "width": 0.5,
                "marker": {"color": [self.look.color(c) for c in mark.colors]},
                "showlegend": False,
                "hoverinfo": "x",
                "xaxis": self.x,
                "yaxis": self.y,
            }
        )

    def add_heat_map(self, mark: HeatMap) -> None:
        """Add a heat map with its color bar, and frames around its marked cells."""
        low, middle, high = self.look.diverging
        bottom, top = self.layout[f"yaxis{self.suffix}"]["domain"]
        self.data.append(
            {
                "type": "heatmap",
                "x": _finite_or_none(mark.x_edges),
                "y": _finite_or_none(mark.y_edges),
                "z": [_finite_or_none(row) for row in mark.values],
                "text": [[_ratio_text(v) for v in row] for row in mark.values],
                "zmin": -mark.limit,
                "zmax": mark.limit,
                "colorscale": [[0, low], [0.5, middle], [1, high]],
                "colorbar": {
                    "title": {"text": html_text(mark.label), "side": "right"},
                    "tickvals": [v for v, _ in mark.ticks],
                    "ticktext": [html_text(t) for _, t in mark.ticks],
                    "outlinewidth": 0,
                    "y": 0.5 * (bottom + top),
                    "len": top - bottom,
                },
                "hovertemplate": "%{text} × the expected power<extra></extra>",
                "xaxis": self.x,
                "yaxis": self.y,
            }
        )
        for row, column in np.argwhere(mark.marked):
            x = mark.x_edges[column : column + 2].tolist()
            y = mark.y_edges[row : row + 2].tolist()
            self.add_shape(*x, *y, type="rect", line={"color": self.look.text, "width": 1})


def _band_outline(band: Band) -> tuple[Any, Any]:
    """(x, y) of the outline of a band: a closed polygon for each range without NaN, separated by NaN.

    Both are empty lists if the band has no finite values.
    """
    pieces = band.gap_free_ranges()
    x: list[Any] = []
    y: list[Any] = []
    for piece in pieces:
        x += [band.x[piece], band.x[piece][::-1], [np.nan]]
        y += [band.high[piece], band.low[piece][::-1], [np.nan]]
    return (np.concatenate(x)[:-1], np.concatenate(y)[:-1]) if pieces else ([], [])


def _ratio_text(log2: float) -> str:
    """Text of the ratio 2^`log2` with two significant digits; a dash if not finite."""
    return number(2.0**log2, 2) if math.isfinite(log2) else "–"


def _show_labels_once(data: list[dict[str, Any]]) -> None:
    """Hide the legend entry of each trace whose label an earlier trace has, in place."""
    named: set[str] = set()
    for trace in data:
        label = trace.get("name", "")
        if trace.get("showlegend") and label in named:
            trace["showlegend"] = False
        named.add(label)

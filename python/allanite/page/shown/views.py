"""Views as plotly documents of at most 300 kB, independent of the length of the log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.units import conversion, parse_unit
from allanite.effects.sheet_units import requested_units
from allanite.page.edits import chosen_units, deviation_unit
from allanite.page.shown import overlays
from allanite.page.shown.figures import displayed_fit, figure_of
from allanite.page.shown.offers import capitalized
from allanite.plots.curves import SINGLE, component_styles
from allanite.plots.plotly_painter import html_text
from allanite.plots.spec import Line, Span
from allanite.plots.themes import theme_of
from allanite.plots.words import unit_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.fit import Fit
    from allanite.page.tab import Tab

#: Views with a legend; in the others the list of effects names the curves.
LEGEND = ("compare", "error", "nis", "thermal", "average")
#: Units in which the cursor can show a deviation.
UNITS = ("rad/s", "deg/s", "deg/h", "m/s^2", "mg", "ug")


def view(
    tab: Tab, name: str, theme: str, options: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Dict of the view `name` in the displayed units; see `_view`.

    Raises `InputError` if the view or theme is unknown, or if there is nothing to show.
    """
    with requested_units(chosen_units(tab.log.unit, tab.unit)):
        return _view(tab, name, theme, options)


def _view(tab: Tab, name: str, theme: str, options: Mapping[str, str] | None) -> dict[str, Any]:
    """Dict of a view in the current units: plotly's ``data`` and ``layout``, title, and what the figure shows.

    ``subtitle`` is the last line of the figure's subtitle, and ``headline`` all lines before. ``fails`` is True if
    ranges are shaded in which the model fails, ``singles`` if single ordinates are drawn. ``drift`` is the label of the
    known function of time in the samples, or empty. With a fit, ``live`` is `drag_data`.
    """
    look = theme_of(theme)
    figure = figure_of(tab, name, options)
    painted = figure.to_plotly(theme)
    data, layout = painted["data"], painted["layout"]
    shown = displayed_fit(tab)
    found: dict[str, Any] = {"name": name, "kind": figure.kind, "title": figure.title}
    found["headline"], _, rest = figure.subtitle.rpartition("\n")
    found["subtitle"] = rest
    marks = [mark for panel in figure.panels for mark in panel.marks]
    found["fails"] = any(isinstance(m, Span) and m.color == "fail" for m in marks)
    found["singles"] = any(isinstance(m, Line) and m.label == SINGLE for m in marks)
    found["drift"] = next(
        (
            m.label
            for m in marks
            if name == "samples" and isinstance(m, Line) and m.color == "model"
        ),
        "",
    )
    layout.pop("title", None)
    # The page shows the title above the plot.
    if len([p for p in figure.panels if p.row == 0]) == 1:
        titles = {f"<b>{html_text(panel.title)}</b>" for panel in figure.panels if panel.title}
        layout["annotations"] = [a for a in layout["annotations"] if a["text"] not in titles]
    unit = deviation_unit(tab.log.unit, tab.unit)
    quantity = figure.panels[0].y.quantity
    overlays.set_hover_texts(data, shown, name, unit if quantity is None else quantity.unit)
    fitted = figure.kind == "fit"
    if shown is not None and fitted:
        _label_traces(data, shown)
        found["live"] = overlays.drag_data(shown, unit)
    if shown is not None and fitted and name == "allan":
        points, labels = overlays.coefficient_readings(shown, tab.work, tab.unit, look, layout)
        data += points
        layout["annotations"] += labels
        found["units"] = _cursor_units(unit)
    for trace in data:
        if trace.get("type") == "heatmap":
            title = trace["colorbar"]["title"]
            title["text"] = capitalized(title["text"])
            title["font"] = {"size": 13}
    _adapt_layout(layout, name, figure.kind, look)
    return {**found, **painted}


def _adapt_layout(layout: dict[str, Any], name: str, kind: str, look: Any) -> None:
    """Change plotly's `layout` in place to the style of the page: axis titles, legend, margins, colors and fonts."""
    for key, axis in layout.items():
        if key.startswith("xaxis") and axis["domain"][0] > 0.0:
            # Leave space for an axis title between two panels.
            axis["domain"] = [axis["domain"][0] + 0.05, axis["domain"][1]]
        if key.startswith("xaxis") or (key.startswith("yaxis") and name != "samples"):
            axis["title"]["text"] = capitalized(axis["title"]["text"])
        if key.startswith(("xaxis", "yaxis")):
            axis["title"]["font"] = {"size": 13}
    layout["showlegend"] = name in LEGEND or kind == "deviation"
    layout["legend"] = {
        "orientation": "h",
        "x": 0,
        "y": 1.06 if name in ("error", "thermal") else 1.0,
        "yanchor": "bottom",
        "font": {"size": 12},
    }
    titled = any(a["yref"] == "paper" for a in layout["annotations"])
    top = 44 if layout["showlegend"] else 28 if titled else 10
    layout["margin"] = {"l": 76, "r": 16, "t": top, "b": 48}
    layout["paper_bgcolor"] = "rgba(0,0,0,0)"
    layout["plot_bgcolor"] = "rgba(0,0,0,0)"
    layout["font"] = {**layout["font"], "size": 13}
    layout["hoverlabel"] = {
        "bgcolor": look.panel,
        "bordercolor": look.faint,
        "align": "left",
        "font": {"color": look.text, "size": 13},
    }


def _cursor_units(unit: str) -> list[dict[str, Any]]:
    """Units in which the readout under the mouse shows deviations; ``factor`` converts from `unit`, which is first."""
    kind = parse_unit(unit).kind
    others = [u for u in UNITS if u != unit and parse_unit(u).kind == kind]
    texts = {unit: unit_text(unit) if unit != "1" else "", **{u: unit_text(u) for u in others}}
    return [{"text": text, "factor": conversion(unit, u)} for u, text in texts.items()]


def _label_traces(data: list[dict[str, Any]], fit: Fit) -> None:
    """Set ``meta`` of each plotly trace to what the trace draws: ``measured``, ``effect-0`` (index in the model), …."""
    for part in component_styles(fit):
        for trace in data:
            if trace.get("name") == html_text(part.label):
                kind = "effect" if part.limit is None else "limit"
                trace["meta"] = f"{kind}-{part.place}"
    for trace in data:
        own = str(trace.get("yaxis")) in ("y", "y1")
        if not own:
            if (
                trace.get("mode") == "markers"
                and trace.get("name") != SINGLE
                and len(trace["x"]) > 1
            ):
                trace["meta"] = "residual"
        elif trace.get("name") == SINGLE:
            trace["meta"] = "single"
        elif trace.get("name") == "model":
            trace["meta"] = "model"
        elif str(trace.get("name", "")).startswith("measured"):
            trace["meta"] = "measured"

"""What the browser draws: plotly documents of at most 300 kB, whatever the length of the log."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.errors import InputError
from allanite.plots.axes import linear_axis
from allanite.plots.curves import allan_panels, parts, spectrum_panels
from allanite.plots.deviation import plot_deviation
from allanite.plots.spec import Band, Figure, Line, Mark, Panel, Span
from allanite.plots.themes import theme_of
from allanite.plots.time import plot_time
from allanite.plots.words import in_unit

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.page.tab import Tab

__all__ = ["VIEWS", "figure_of", "finite", "view"]

#: Stretches of the samples' envelope: more than a screen has pixels to tell apart.
STRETCHES = 1600


def view(tab: Tab, name: str, theme: str) -> dict[str, Any]:
    """A view as plotly's data and layout, with the roles of its traces.

    Parameters
    ----------
    tab : Tab
    name : str
        One of `VIEWS`.
    theme : {"light", "dark"}

    Raises
    ------
    InputError
        An unknown view or theme, or nothing to show.
    """
    look = theme_of(theme)
    figure = figure_of(tab, name)
    painted = figure.to_plotly(theme)
    shown = _fit(tab)
    if shown is not None and name in ("allan", "psd"):
        _mark_components(painted["data"], shown)
    layout = painted["layout"]
    layout.pop("title", None)
    # The title stands above the plot in the page's own type; the chips are the legend.
    layout["annotations"] = [a for a in layout["annotations"] if not _is_title(a, figure)]
    layout["showlegend"] = name == "compare"
    layout["legend"] = {
        "orientation": "h",
        "x": 0,
        "y": 1.0,
        "yanchor": "bottom",
        "font": {"size": 12},
    }
    layout["margin"] = {"l": 76, "r": 18, "t": 34 if name == "compare" else 10, "b": 48}
    layout["paper_bgcolor"] = "rgba(0,0,0,0)"
    layout["plot_bgcolor"] = "rgba(0,0,0,0)"
    layout["font"] = {**layout["font"], "size": 13}
    layout["hoverlabel"] = {"bgcolor": look.panel, "font": {"color": look.text, "size": 13}}
    return {"name": name, "title": figure.title, "subtitle": figure.subtitle, **painted}


def figure_of(tab: Tab, name: str) -> Figure:
    """The figure behind a view, for the screen and for files."""
    if name not in VIEWS:
        raise InputError(f"unknown view {name!r}: one of {', '.join(VIEWS)}")
    return VIEWS[name](tab)


def _fit(tab: Tab) -> Fit | None:
    if tab.preview is not None:
        return tab.preview
    return tab.ladder.steps[tab.ladder.at].fit if tab.ladder.steps else None


def _allan(tab: Tab) -> Figure:
    fit = _fit(tab)
    if fit is None:
        # Before the first fit there is the measured curve alone.
        return plot_deviation(tab.log.oadev())
    check = tab.step.check if tab.preview is None else None
    panels = allan_panels(fit, 0, None if check is None else check.where.worst_tau)
    return Figure("Allan deviation", f"model {fit.model.name}", panels, (3.0, 1.0), kind="fit")


def _psd(tab: Tab) -> Figure:
    fit = _fit(tab) or tab.step.fit
    check = tab.step.check if tab.preview is None else None
    panels = spectrum_panels(fit, 0, None if check is None else check.where.worst_frequency)
    return Figure(
        "Power spectral density, two-sided",
        f"model {fit.model.name}",
        panels,
        (3.0, 1.0),
        kind="fit",
    )


def _map(tab: Tab) -> Figure:
    check = tab.step.check
    if check is None:
        raise InputError("the map is being made")
    return plot_time(check)


def _samples(tab: Tab) -> Figure:
    recording = tab.log
    x = np.ascontiguousarray(recording.rate_samples(), dtype=np.float64)
    low, high = _kernels.envelope(x, STRETCHES)
    span = recording.duration
    size, unit = next(
        (
            (s, u)
            for above, s, u in (
                (172800.0, 86400.0, "d"),
                (7200.0, 3600.0, "h"),
                (240.0, 60.0, "min"),
            )
            if span >= above
        ),
        (1.0, "s"),
    )
    time = (np.arange(low.size) + 0.5) * span / low.size / size
    kept = np.isfinite(low)
    marks: list[Mark] = []
    check = tab.step.check if tab.ladder.steps else None
    if check is not None and check.where.worst_time is not None:
        a, b = check.where.worst_time
        marks.append(Span(a / size, b / size, "fail", "where the model fails"))
    if x.size > low.size:
        marks.append(Band(time[kept], low[kept], high[kept], "c1", "smallest to largest"))
    else:
        marks.append(Line(time[kept], high[kept], "c1", "samples", 1.0))
    marks.append(Line(time[kept], 0.5 * (low + high)[kept], "measured", "middle", 0.8))
    room = 0.05 * float(np.ptp([low[kept].min(), high[kept].max()])) or 1.0
    y = linear_axis(
        in_unit(recording.columns[0], recording.unit),
        low[kept].min() - room,
        high[kept].max() + room,
    )
    panel = Panel(linear_axis(f"time ({unit})", 0.0, span / size, 8), y, tuple(marks))
    each = x.size / low.size
    what = f"smallest to largest of {each:.0f} samples each" if each > 1 else "every sample"
    return Figure(
        "Samples", f"{x.size:,} samples, {what}".replace(",", " "), (panel,), kind="samples"
    )


def _compare(tab: Tab) -> Figure:
    """All columns of the log, the model, and a twin simulated from it."""
    from allanite.comparison import compare
    from allanite.plots import plot_compare

    fit = tab.step.fit
    assert tab.recording is not None
    items: list[Any] = [(f"{tab.log.columns[0]}, measured", tab.log, None)]
    items.append(
        (
            "simulated twin",
            fit.model.simulate(
                n=fit.data.n,
                rate=fit.data.rate,
                unit=fit.recording.unit,
                seed=1,
                covariates=dict(fit.data.covariates),
            ),
            None,
        )
    )
    items += [(c.columns[0], c, None) for c in tab.recording if c.columns != tab.log.columns]
    items += [(name, other, None) for name, other in tab.others]
    return plot_compare(compare(items[:8]))


VIEWS = {"allan": _allan, "psd": _psd, "map": _map, "samples": _samples, "compare": _compare}


def _mark_components(data: list[dict[str, Any]], fit: Fit) -> None:
    """Tell the page which line belongs to which chip."""
    order = [*fit.model.stochastic, *fit.model.deterministic]
    for effect, part in zip(order, parts(fit), strict=True):
        place = next(i for i, e in enumerate(fit.model.effects) if e is effect)
        for trace in data:
            if trace.get("name") == part.label:
                trace["meta"] = f"effect-{place}"


def _is_title(annotation: dict[str, Any], figure: Figure) -> bool:
    return any(
        panel.title and annotation["text"] == f"<b>{panel.title}</b>" for panel in figure.panels
    )


def finite(value: Any) -> Any:
    """JSON without NaN, numbers in seven figures: a curve on a screen needs no more."""
    if isinstance(value, dict):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else None
    return value

"""What the browser draws: plotly documents of at most 300 kB, whatever the length of the log."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.plots.curves import allan_panels, parts, spectrum_panels
from allanite.plots.deviation import plot_deviation
from allanite.plots.plotly_painter import words
from allanite.plots.recording import samples_panel
from allanite.plots.spec import Figure
from allanite.plots.themes import theme_of
from allanite.plots.time import plot_time
from allanite.report.words import many

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.recording import Recording

__all__ = ["VIEWS", "figure_of", "finite", "view"]

#: Curves that can be told apart on one pair of axes.
MOST_CURVES = 8
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
    for trace in painted["data"]:
        # Nothing else is compared here.
        trace["name"] = str(trace.get("name") or "").removesuffix(" (recording)")
    layout = painted["layout"]
    layout.pop("title", None)
    # The title stands above the plot in the page's own type; the chips are the legend.
    layout["annotations"] = [a for a in layout["annotations"] if not _is_title(a, figure)]
    for key, axis in layout.items():
        if key.startswith("xaxis") and axis["domain"][0] > 0.0:
            # A page is narrower than paper: room for the title of an axis between two panels.
            axis["domain"] = [axis["domain"][0] + 0.05, axis["domain"][1]]
    layout["showlegend"] = name == "compare"
    layout["legend"] = {
        "orientation": "h",
        "x": 0,
        "y": 1.0,
        "yanchor": "bottom",
        "font": {"size": 12},
    }
    layout["margin"] = {"l": 82, "r": 18, "t": 34 if name == "compare" else 10, "b": 48}
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
    log = tab.log
    check = tab.step.check if tab.ladder.steps else None
    worst = None if check is None else check.where.worst_time
    panel = samples_panel(log, stretches=STRETCHES, worst=worst)
    each = log.n / STRETCHES
    what = f"smallest and largest of {each:.0f} samples each" if each > 1 else "every sample"
    return Figure("Samples", f"{many(log.n)} samples, {what}", (panel,), kind="samples")


def _compare(tab: Tab) -> Figure:
    """The log, a twin simulated from the model, other logs, other columns."""
    from allanite.comparison import compare
    from allanite.plots import plot_compare

    log = tab.log
    items: list[Any] = [(f"{log.columns[0]}, measured", log, None)]
    if tab.ladder.steps:
        items.append(("a simulated twin", _twin(tab.step.fit), None))
    items += [(name, other, None) for name, other in tab.others]
    assert tab.recording is not None
    items += [(c.columns[0], c, None) for c in tab.recording if c.columns != log.columns]
    return plot_compare(compare(items[:MOST_CURVES]))


def _twin(fit: Fit) -> Recording:
    data = fit.data
    return fit.simulate(n=data.n, rate=data.rate, seed=1, covariates=dict(data.covariates))


VIEWS = {"allan": _allan, "psd": _psd, "map": _map, "samples": _samples, "compare": _compare}


def _mark_components(data: list[dict[str, Any]], fit: Fit) -> None:
    """Tell the page which line belongs to which chip."""
    order = [*fit.model.stochastic, *fit.model.deterministic]
    for effect, part in zip(order, parts(fit), strict=True):
        place = next(i for i, e in enumerate(fit.model.effects) if e is effect)
        for trace in data:
            if trace.get("name") == words(part.label):
                trace["meta"] = f"effect-{place}"


def _is_title(annotation: dict[str, Any], figure: Figure) -> bool:
    return any(
        panel.title and annotation["text"] == f"<b>{words(panel.title)}</b>"
        for panel in figure.panels
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

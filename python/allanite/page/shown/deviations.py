"""Figure of the measured curve with another estimator or other averaging times than those of the fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import allanite.deviation as family
from allanite.common.errors import InputError
from allanite.deviation import ESTIMATORS, estimator_named
from allanite.plots.axes import log_axis
from allanite.plots.curves import TAU
from allanite.plots.deviation import deviation_points
from allanite.plots.scaling import deviation_axis
from allanite.plots.spec import Figure, Line, Mark, Panel
from allanite.plots.words import label_in_unit
from allanite.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.deviation import Deviation
    from allanite.fit import Fit

#: Name and menu text of each offered estimator, in the order of the menu; the first is the default.
KINDS = {
    name: choice.text
    for choice, name in sorted((e.choice, e.name) for e in ESTIMATORS.values() if e.choice)
}
GRIDS: dict[str, str | int] = {"octave": "octave", "decade": "decade", "fine": 20}
#: Maximum number of samples of a simulated sensor, so that the user need not wait long.
MAX_SIMULATED = 2_000_000


def deviation_figure(
    log: Recording, fit: Fit | None, options: Mapping[str, str], kept: dict[Any, Deviation]
) -> Figure | None:
    """`Figure` of the estimator ``options["kind"]`` at the averaging times ``options["grid"]``; None for the default.

    The figure of the fit shows the default, the overlapping Allan deviation. For Allan deviations, the model is also
    drawn. For other estimators, the deviation of one simulated record is drawn instead, if the log has at most 2
    million samples. `kept` is a cache.
    """
    kind, grid = options.get("kind") or "oadev", options.get("grid") or ""
    if kind not in KINDS:
        raise InputError(f"No deviation {kind[:20]!r}: one of {', '.join(KINDS)}")
    if grid and grid not in GRIDS:
        raise InputError(f"No averaging times {grid[:20]!r}: one of {', '.join(GRIDS)}")
    if kind == "oadev" and not grid:
        return None
    found = _deviation_of(log, kind, grid, kept)
    marks: list[Mark] = []
    shown = [np.asarray(found.deviation), np.asarray(found.low), np.asarray(found.high)]
    if fit is not None and estimator_named(kind).allan:
        marks.append(Line(fit.curve.tau, fit.curve.model, "model", "model", 2.2))
    elif fit is not None and log.n <= MAX_SIMULATED:
        simulated = _deviation_of(fit, kind, grid, kept)
        drawn = deviation_points(simulated, "model", "")
        marks.append(Line(drawn.x, drawn.y, "model", "Simulated sensor", 1.6))
        shown.append(np.asarray(simulated.deviation))
    points = deviation_points(found, "measured", "measured")
    marks.append(points)
    title = estimator_named(kind).title
    title = title[0].upper() + title[1:]
    y = log_axis(label_in_unit(title, found.deviation_unit), *shown)
    if found.deviation_unit == log.unit:
        y = deviation_axis(log.unit, y, title)
    panel = Panel(log_axis(TAU, points.x), y, tuple(marks), title=title)
    return Figure(title, f"{points.x.size} averaging times", (panel,), kind="deviation")


def simulated_sensor(fit: Fit) -> Recording:
    """`Recording` of a sensor simulated from the fit, as long as the record, with seed 1."""
    data = fit.data
    return fit.simulate(n=data.n, rate=data.rate, seed=1, covariates=dict(data.covariates))


def _deviation_of(
    source: Recording | Fit, kind: str, grid: str, kept: dict[Any, Deviation]
) -> Deviation:
    """`Deviation` by the estimator `kind` of a recording, or of a sensor simulated from a `Fit`; `kept` is a cache."""
    key = source, kind, grid
    if key not in kept:
        log = source if isinstance(source, Recording) else simulated_sensor(source)
        kept[key] = getattr(family, kind)(log, **({"taus": GRIDS[grid]} if grid else {}))
    return kept[key]

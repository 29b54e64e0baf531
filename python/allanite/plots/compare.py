"""Figure that compares recordings, models and data sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.units import conversion, parse_unit
from allanite.plots.axes import log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Axis, Figure, Line, Mark, Panel, Points
from allanite.plots.themes import LOGS

if TYPE_CHECKING:
    from pathlib import Path


#: Maximum number of letters of a subtitle that names all curves; longer texts would take a second line.
MAX_SUBTITLE = 120
#: Kind of a curve → its color. Other kinds have the color of their name, which is shared by a log and its model.
COLORS = {"simulated": "model", "datasheet": "guide"}


def plot_compare(
    curves: Any, path: str | Path | None = None, theme: str = "light", title: str = "Comparison"
) -> Figure:
    """`Figure` of several Allan deviations: recordings as points with 95 % intervals, models and data sheets as lines.

    Parameters
    ----------
    curves : Curves or sequence of Curve
        Result of `allanite.compare`, or objects with ``name, kind, unit, tau, deviation, low, high``. Curves are
        converted to the unit of the first one; other kinds of sensors have their own panel below, over the same τ.
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}
    title : str

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    items = tuple(getattr(curves, "curves", curves))
    named = list(dict.fromkeys(c.name for c in items))
    kinds = tuple(dict.fromkeys(parse_unit(c.unit).kind for c in items))
    # The τ axis covers the measured curves, because the line of a data sheet has no limits.
    measured = [c.tau for c in items if c.low is not None] or [c.tau for c in items]
    x = log_axis(TAU, *measured)
    panels = tuple(
        _sensor_panel(
            [(named.index(c.name), c) for c in items if parse_unit(c.unit).kind == kind],
            x,
            place,
            last=place == len(kinds) - 1,
            title=kind if len(kinds) > 1 else "",
        )
        for place, kind in enumerate(kinds)
    )
    names = " · ".join(named)
    if len(names) > MAX_SUBTITLE:
        names = f"{' · '.join(named[:3])} · {len(named) - 3} more"
    figure = Figure(title, names, panels, (1.0,) * len(panels), kind="compare")
    return in_figure_units(figure).saved(path, theme)


def _sensor_panel(
    items: list[tuple[int, Any]], x: Axis, row: int, *, last: bool, title: str
) -> Panel:
    """`Panel` of the Allan deviations of one kind of sensor, in the unit of the first curve.

    `items` are tuples (index of the color, curve). The y axis covers all values and intervals; an upper end counts at
    most as four times the value.
    """
    unit = items[0][1].unit
    measured = {curve.name for _, curve in items if curve.kind == "recording"}
    marks: list[Mark] = []
    shown: list[Any] = []
    for i, curve in items:
        factor = conversion(curve.unit, unit)
        color = COLORS.get(curve.kind, LOGS[i % len(LOGS)])
        values = np.asarray(curve.deviation) * factor
        shown.append(values)
        # The color shows which model belongs to which log.
        label = "model" if curve.kind == "model" and curve.name in measured else curve.name
        if curve.low is None or curve.high is None:
            dash = "dash" if curve.kind == "model" else "dot"
            marks.append(Line(curve.tau, values, color, label, 2.0, dash))
            continue
        low, high = np.asarray(curve.low) * factor, np.asarray(curve.high) * factor
        shown += [low, np.minimum(high, 4.0 * values)]
        marks.append(Line(curve.tau, values, color, width=1.0))
        marks.append(Points(curve.tau, values, color, label, low, high))
    y = deviation_axis(unit, log_axis("", *shown))
    return Panel(x, y, tuple(marks), row, title=title, show_x=last)

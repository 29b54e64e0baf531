"""The figure of a combination: deviations of the units and of their averages, and the weights over τ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.numbers import number
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Figure, Line, Mark, Panel, Points
from allanite.plots.themes import LOGS

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.combination.combine import Combination


def plot_combination(
    found: Combination, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """`Figure` of the Allan deviations of the units, their mean and the combination, and of the best weights over τ."""
    marks: list[Mark] = []
    weights: list[Mark] = []
    for k, name in enumerate(found.labels):
        # The first color of logs is that of the combined samples.
        color = LOGS[1 + k % (len(LOGS) - 1)]
        marks.append(Line(found.tau, found.single[:, k], color, name, width=1.2))
        weights.append(Line(found.tau, found.best_weights[:, k], color, width=1.2))
    marks.append(Line(found.tau, found.equal, "before", "mean", dash="dash"))
    marks.append(Line(found.tau, found.combined, "model", "combined", width=2.2))
    if found.measured is not None:
        marks.append(Points(found.tau, found.measured, "measured", "combined samples"))
    y = deviation_axis(found.unit, log_axis("", found.single, found.combined))
    low, high = float(found.best_weights.min()), float(found.best_weights.max())
    room = 0.1 * max(high - low, 0.2)
    panels = (
        Panel(log_axis(TAU, found.tau), y, tuple(marks), show_x=False),
        Panel(
            log_axis(TAU, found.tau),
            linear_axis("best weight", min(low, 0.0) - room, high + room, 4),
            tuple(weights),
            row=1,
        ),
    )
    # Equal numbers in print are one number.
    gains = dict.fromkeys(number(gain) for gain in (found.gain.min(), found.gain.max()))
    figure = Figure(
        f"{len(found.labels)} units averaged to one sensor",
        f"Allan deviation {' to '.join(gains)} times lower than that of the best unit",
        panels,
        heights=(2.4, 1.0),
        kind="combination",
    )
    return in_figure_units(figure).saved(path, theme)

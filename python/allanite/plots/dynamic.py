"""Figure of a deviation in moving windows over the record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import duration_text, time_scale
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Figure, Line, Mark, Panel, Points
from allanite.plots.themes import COMPONENTS

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.deviation.dynamic import DynamicDeviation

#: Maximum number of windows that are marked individually.
MAX_MARKED = 80


def plot_dynamic(
    dynamic: DynamicDeviation, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """`Figure`: overlapping Allan deviation of windows along the record, over time, with a line for each of up to six τ.

    The figure is written to `path` (SVG, PNG or PDF) if given.
    """
    half = 0.5 * dynamic.window
    low, high = float(dynamic.time[0]) - half, float(dynamic.time[-1]) + half
    size, name = time_scale(high - low)
    marks: list[Mark] = []
    for color, k in zip(COMPONENTS, dynamic.shown(len(COMPONENTS)), strict=False):
        time, values = dynamic.time / size, dynamic.deviation[:, k]
        marks.append(Line(time, values, color, f"τ = {dynamic.tau[k]:.4g} s"))
        if time.size <= MAX_MARKED:
            marks.append(Points(time, values, color, size=3.0))
    words = "overlapping Allan deviation"
    shown = [m.y for m in marks if isinstance(m, Line)]
    panel = Panel(
        linear_axis(f"time ({name})", low / size, high / size, 8),
        deviation_axis(dynamic.unit, log_axis("", np.concatenate(shown)), words),
        tuple(marks),
    )
    windows = f"{dynamic.time.size} windows of {duration_text(dynamic.window)}"
    figure = Figure(words[0].upper() + words[1:] + " over time", windows, (panel,), kind="dynamic")
    return in_figure_units(figure).saved(path, theme)

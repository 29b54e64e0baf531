"""Figure of samples over time: minimum, maximum and mean of short segments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.numbers import time_scale
from allanite.plots.axes import linear_axis
from allanite.plots.scaling import in_figure_units, sample_axis
from allanite.plots.spec import Band, Figure, Line, Mark, Panel
from allanite.plots.words import recording_text

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.recording import Recording

#: A figure divides a record into this many segments and draws minimum, maximum and mean of each.
SEGMENTS = 600

Array = NDArray[np.float64]


def plot_recording(
    recording: Recording, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """`Figure`: samples over time, one panel per column: range and mean of short segments; gaps interrupt the lines.

    Parameters
    ----------
    recording : Recording
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Returns
    -------
    Figure
        The figure as data; notebooks display it.

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    columns = list(recording)
    panels = tuple(
        samples_panel(column, i, i == len(columns) - 1, len(columns) > 1)
        for i, column in enumerate(columns)
    )
    figure = Figure(
        recording_text(columns[0] if len(columns) == 1 else recording),
        f"{recording.n} samples",
        panels,
        heights=(1.0,) * len(panels),
        kind="recording",
    )
    return in_figure_units(figure).saved(path, theme)


def samples_panel(
    column: Recording,
    row: int = 0,
    last: bool = True,
    named: bool = True,
    segments: int = SEGMENTS,
) -> Panel:
    """`Panel` of one column over time: minimum, maximum and mean of each of `segments` short segments.

    Only the mean if minimum and maximum are equal everywhere. `last` shows the time axis, `named` labels the y axis
    with the name of the column.
    """
    size, name = time_scale(column.duration)
    time, low, high, mean = _segments(column.rate_samples(), segments)
    time *= column.duration / size
    marks: list[Mark] = []
    if np.nanmax(high - low) > 0:
        marks.append(Band(time, low, high, "c1", "minimum–maximum"))
        marks.append(Line(time, mean, "c1", "mean", width=1.1))
    else:
        marks.append(Line(time, mean, "c1", "samples", width=1.1))
    margin = 0.05 * float(np.nanmax(high) - np.nanmin(low))
    words = column.columns[0] if named else "samples"
    y = linear_axis(
        "",
        float(np.nanmin(low)) - margin,
        float(np.nanmax(high)) + margin,
    )
    y = sample_axis(column.unit, y, words)
    x = linear_axis(f"time ({name})", 0.0, column.duration / size, 8)
    return Panel(x, y, tuple(marks), row, show_x=last)


def _segments(samples: NDArray[Any], segments: int) -> tuple[Array, Array, Array, Array]:
    """Tuple (relative time 0 to 1, minimum, maximum, mean) of each segment; NaN if all its samples are missing."""
    values = np.ascontiguousarray(samples, dtype=np.float64)
    low, high = _kernels.envelope(values, segments)
    # The segments of `_kernels.envelope`.
    edges = np.arange(low.size + 1) * values.size // low.size
    here = ~np.isnan(values)
    count = np.add.reduceat(here, edges[:-1], dtype=float)
    total = np.add.reduceat(np.where(here, values, 0.0), edges[:-1])
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    return 0.5 * (edges[:-1] + edges[1:]) / values.size, low, high, mean

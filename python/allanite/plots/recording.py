"""The samples themselves over time: the least and the largest of each stretch, and their mean."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.plots.axes import linear_axis
from allanite.plots.spec import Band, Figure, Line, Mark, Panel
from allanite.plots.time import time_scale
from allanite.plots.words import in_unit, recording_text

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.recording import Recording

__all__ = ["plot_recording"]

#: Stretches that a figure resolves.
STRETCHES = 600

Array = NDArray[np.float64]


def plot_recording(
    recording: Recording, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """Samples over time, a panel a column: the span of each stretch and its mean; gaps stay open.

    Parameters
    ----------
    recording : Recording
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Returns
    -------
    Figure
        The figure as data; a notebook draws it.

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    columns = list(recording)
    panels = tuple(
        _panel(column, i, i == len(columns) - 1, len(columns) > 1)
        for i, column in enumerate(columns)
    )
    figure = Figure(
        recording_text(columns[0] if len(columns) == 1 else recording),
        f"{recording.n} samples",
        panels,
        heights=(1.0,) * len(panels),
        kind="recording",
    )
    if path is not None:
        figure.save(path, theme)
    return figure


def _panel(column: Recording, row: int, last: bool, named: bool) -> Panel:
    size, name = time_scale(column.duration)
    time, low, high, mean = _stretches(column.rate_samples())
    time *= column.duration / size
    marks: tuple[Mark, ...] = (Line(time, mean, "c1", "samples", width=1.1),)
    if np.nanmax(high - low) > 0:
        span = Band(time, low, high, "c1", "least and largest sample")
        marks = (span, Line(time, mean, "c1", "mean of a stretch", width=1.1))
    room = 0.05 * float(np.nanmax(high) - np.nanmin(low))
    y = linear_axis(
        in_unit(column.columns[0] if named else "samples", column.unit),
        float(np.nanmin(low)) - room,
        float(np.nanmax(high)) + room,
    )
    x = linear_axis(f"time ({name})", 0.0, column.duration / size, 8)
    return Panel(x, y, marks, row, show_x=last)


def _stretches(samples: NDArray[Any]) -> tuple[Array, Array, Array, Array]:
    """Time (0 to 1), least, largest and mean sample of each stretch; NaN where all are missing."""
    values = samples.astype(np.float64)
    starts = np.unique(
        np.linspace(0, values.size, min(STRETCHES, values.size) + 1)[:-1].astype(int)
    )
    here = ~np.isnan(values)
    count = np.add.reduceat(here.astype(float), starts)
    low = np.fmin.reduceat(values, starts)
    high = np.fmax.reduceat(values, starts)
    total = np.add.reduceat(np.where(here, values, 0.0), starts)
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    ends = np.append(starts[1:], values.size)
    return 0.5 * (starts + ends) / values.size, low, high, mean

"""Figure of samples over time: minimum, maximum and mean of short segments."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.numbers import count_text, time_scale
from allanite.plots.axes import linear_axis
from allanite.plots.scaling import in_figure_units, sample_axis
from allanite.plots.spec import Axis, Band, Figure, Line, Mark, Panel
from allanite.plots.words import recording_text

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.recording import Recording

#: A figure divides a record into this many segments and draws minimum, maximum and mean of each.
SEGMENTS = 600
#: Maximum number of points of a function of time, and of segments of a logged column.
SIGNAL_POINTS, COLUMN_SEGMENTS = 1600, 800
#: Number of segments whose means are drawn: enough to show a drift, few enough to average the white noise.
MEANS = 120
#: Maximum number of ticks of a logged column, whose panel is low.
MAX_STRIP_TICKS = 4

Array = NDArray[np.float64]


def plot_recording(
    recording: Recording,
    path: str | Path | None = None,
    theme: str = "light",
    segments: int = SEGMENTS,
) -> Figure:
    """`Figure`: samples over time, one panel per column: range and mean of short segments; gaps interrupt the lines.

    Parameters
    ----------
    recording : Recording
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}
    segments : int
        Number of segments of the time axis.

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
        samples_panel(column, i, i == len(columns) - 1, len(columns) > 1, segments)
        for i, column in enumerate(columns)
    )
    figure = Figure(
        recording_text(columns[0] if len(columns) == 1 else recording),
        f"{count_text(recording.n)} samples",
        panels,
        heights=(1.0,) * len(panels),
        kind="recording",
    )
    return in_figure_units(figure).saved(path, theme)


def samples_panel(
    column: Recording, row: int = 0, last: bool = True, named: bool = True, segments: int = SEGMENTS
) -> Panel:
    """`Panel` of one column over time: minimum, maximum and mean of each of `segments` short segments.

    Only the mean if minimum and maximum are equal everywhere. `last` shows the time axis.
    """
    size, name = time_scale(column.duration)
    time, low, high, mean = _segment_statistics(column.rate_samples(), segments)
    time *= column.duration / size
    marks: list[Mark] = []
    if np.nanmax(high - low) > 0:
        marks.append(Band(time, low, high, "c1", "minimum–maximum"))
        marks.append(Line(time, mean, "c1", "mean", width=1.1))
    else:
        marks.append(Line(time, mean, "c1", "samples", width=1.1))
    margin = 0.05 * float(np.nanmax(high) - np.nanmin(low))
    words = column.columns[0] if named else "samples"
    y = linear_axis("", float(np.nanmin(low)) - margin, float(np.nanmax(high)) + margin)
    y = sample_axis(column.unit, y, words)
    x = linear_axis(f"time ({name})", 0.0, column.duration / size, 8)
    return Panel(x, y, tuple(marks), row, show_x=last)


def means_panel(column: Recording, signal: Array | None) -> Panel:
    """`Panel` with the means of 120 equal segments of one column, in which a drift is visible below the white noise.

    `signal` is a function of time that another mark will show, or None; the y axis also covers its means.
    """
    size, name = time_scale(column.duration)
    time, _, _, mean = _segment_statistics(column.rate_samples(), MEANS)
    line = Line(time * column.duration / size, mean, "raw", "means of short segments", width=1.1)
    shown = [mean]
    if signal is not None:
        shown.append(_segment_statistics(signal + _mean_difference(column, signal), MEANS)[3])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    margin = 0.1 * (high - low)
    y = sample_axis(column.unit, linear_axis("", low - margin, high + margin), "samples")
    return Panel(linear_axis(f"time ({name})", 0.0, column.duration / size, 8), y, (line,))


def signal_line(
    log: Recording, signal: Array, name: str, first: int = 0, n: int | None = None
) -> Line:
    """`Line` of a function of time over `n` samples from `first` on, shifted to the mean of all samples.

    At most 1600 points are drawn; times have the unit that suits these samples.
    """
    n = signal.size - first if n is None else min(n, signal.size - first)
    size, _ = time_scale(n / log.rate)
    at = first + np.unique(np.linspace(0, n - 1, min(n, SIGNAL_POINTS)).round().astype(int))
    time = np.asarray(at / (log.rate * size), dtype=np.float64)
    return Line(time, _mean_difference(log, signal) + signal[at], "model", name, 2.0)


def _mean_difference(log: Recording, signal: Array) -> float:
    """Mean of the rate samples of `log` that are not missing, minus the mean of `signal`."""
    return float(np.nanmean(log.rate_samples()) - np.mean(signal))


def column_panel(
    part: Recording,
    name: str,
    values: NDArray[Any],
    x: Axis,
    row: int,
    last: bool = True,
    begin: float = 0.0,
) -> Panel:
    """`Panel` of a logged column over the time of `part`, as means of up to 800 segments; NaN in one without values.

    `begin` is the time of the first sample in the unit of the axis `x`.
    """
    size, _ = time_scale(part.duration)
    n = min(values.size, COLUMN_SEGMENTS)
    middle, mean = _segment_means(values, n)
    time = np.asarray(begin + middle / (part.rate * size), dtype=np.float64)
    unit = part.covariate_units.get(name, "1")
    label = name if unit == "1" else f"{name} ({unit.replace('degC', '°C')})"
    low, high = (
        (float(np.nanmin(mean)), float(np.nanmax(mean))) if np.isfinite(mean).any() else (0.0, 1.0)
    )
    room = 0.08 * (high - low)
    y = linear_axis(label, low - room, high + room)
    if len(y.ticks) > MAX_STRIP_TICKS:
        y = replace(y, ticks=y.ticks[::2])
    return Panel(x, y, (Line(time, mean, "c4", name, 1.2),), row, show_x=last)


def _segment_statistics(samples: NDArray[Any], segments: int) -> tuple[Array, Array, Array, Array]:
    """(time relative to the duration, minimum, maximum, mean) of at most `segments` equal segments, NaN without samples."""
    values = np.ascontiguousarray(samples, dtype=np.float64)
    low, high = _kernels.envelope(values, segments)
    middle, mean = _segment_means(values, low.size)
    return middle / values.size, low, high, mean


def _segment_means(values: NDArray[Any], segments: int) -> tuple[Array, Array]:
    """(middle as an index of samples, mean of the finite values or NaN) of each segment of `_kernels.envelope`."""
    edges = np.arange(segments + 1) * values.size // segments
    there = np.isfinite(values)
    count = np.add.reduceat(there, edges[:-1], dtype=float)
    total = np.add.reduceat(np.where(there, values, 0.0), edges[:-1])
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    return np.asarray(0.5 * (edges[:-1] + edges[1:]), dtype=np.float64), mean

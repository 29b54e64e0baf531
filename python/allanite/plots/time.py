"""Heat map of measured divided by expected power, by time and octave band, which shows when a model fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import time_scale
from allanite.fit.likelihood.peaks import has_all_ordinates
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.spec import Axis, Figure, HeatMap, Mark, Note, Panel, Rule
from allanite.plots.words import recording_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from allanite.suggestion import Check

#: Ratio of measured to expected power at which the color scale saturates.
MAX_FACTOR = 4.0
#: Cells with a larger |z| are framed. If the model is true, about 1 % of maps of 450 cells have a framed cell.
MIN_FRAMED_Z = 4.3
#: Number of rows, and maximum number of columns, of the close-up of a narrow frequency range.
CLOSE_ROWS, MAX_CLOSE_COLUMNS = 24, 60
#: Minimum number of columns of a close-up, so that a drift is visible.
MIN_CLOSE_COLUMNS = 4


def plot_time(check: Check, path: str | Path | None = None, theme: str = "light") -> Figure:
    """`Figure`: heat map of measured divided by expected power, by time and octave band; significant cells are framed.

    A record that is too short for a map has a note instead. The figure is written to `path` (SVG, PNG or PDF) if given.
    With `path`, raises `InputError` for another suffix, for a folder that does not exist, or without matplotlib.
    """
    fit = check.fit
    panel = _map_panel(check.where.time, check.where.worst_time, fit.data.duration)
    marked = sum(int(m.marked.sum()) for m in panel.find(HeatMap))
    what = (
        "record too short for a map"
        if not check.where.time
        else (
            f"{marked} significant cell{'s' if marked != 1 else ''}, framed"
            if marked
            else "no significant cell"
        )
    )
    figure = Figure(
        f"{recording_text(fit.recording)} · model {fit.model.name}",
        f"measured over expected power: {what}",
        (panel,),
        kind="time",
    )
    return figure.saved(path, theme)


def _map_panel(
    rows: Sequence[dict[str, Any]], worst: tuple[float, float] | None, span: float
) -> Panel:
    """`Panel` with a color map of measured over expected power, by time and octave of frequency.

    `rows` are dicts, one per cell of the map, with its time and frequency limits, ratio and z. `worst` is the time
    range in s in which the model fails, or None; dashed lines mark both ends. `span` is the duration in s. Colors show
    the logarithm of the ratio from ¼ to 4. Cells with |z| > 4.3 are framed.
    """
    size, name = time_scale(span)
    label = f"time ({name})"
    if not rows:
        empty = Axis("frequency f (Hz)", 0.1, 10.0, True)
        note = Note(0.5, 0.5, "no time map: the record is too short", "faint")
        return Panel(linear_axis(label, 0.0, span / size), empty, (note,), grid=False)
    times = np.unique([v for r in rows for v in (r["start_s"], r["end_s"])])
    bands = np.unique([v for r in rows for v in (r["low_hz"], r["high_hz"])])
    values = np.full((bands.size - 1, times.size - 1), np.nan)
    marked = np.zeros(values.shape, dtype=bool)
    for row in rows:
        # A cell may be wider than the finest step of the map.
        a, b = np.searchsorted(bands, (row["low_hz"], row["high_hz"]))
        c, d = np.searchsorted(times, (row["start_s"], row["end_s"]))
        values[a:b, c:d] = np.log2(max(float(row["ratio"]), 1e-6))
        marked[a:b, c:d] = abs(float(row["z"])) > MIN_FRAMED_Z
    limit = float(np.log2(MAX_FACTOR))
    ticks = ((-2.0, "≤ ¼"), (-1.0, "½"), (0.0, "1"), (1.0, "2"), (2.0, "≥ 4"))
    heat = HeatMap(
        times / size, bands, values, limit, "measured over expected power", ticks, marked
    )
    marks: list[Mark] = [heat]
    if worst is not None:
        marks += [Rule(t / size, "x", "text", "dash", "when the model fails", 1.4) for t in worst]
    x = linear_axis(label, float(times[0]) / size, float(times[-1]) / size, 8)
    y = log_axis("frequency f (Hz)", bands[bands > 0], margin=1.0)
    return Panel(x, y, tuple(marks), grid=False)


def failing_range_panel(check: Check) -> Panel | None:
    """Color map of measured over expected power by time and frequency, around the worst-fitted frequency range.

    The map shows whether lines and bands drift. None if no range narrower than an octave fails, if fewer than 4 time
    intervals fit into the record, for summaries, and if over 10 % of the samples are missing.
    """
    fit, worst = check.fit, check.where.worst_frequency
    data = fit.data
    if worst is None or worst[1] >= 2.0 * worst[0] or not has_all_ordinates(data):
        return None
    wide = worst[1] - worst[0]
    low, high = max(worst[0] - wide, 0.5 * worst[0]), min(worst[1] + wide, 0.5 * data.rate)
    x = np.asarray(fit.recording.rate_samples(), dtype=np.float64).ravel()
    x = np.where(np.isfinite(x), x, np.nanmean(x))
    # Each row has at least one frequency of the transform.
    length = max(int(CLOSE_ROWS * data.rate / (high - low)) + 2, x.size // MAX_CLOSE_COLUMNS)
    columns = x.size // length
    if columns < MIN_CLOSE_COLUMNS:
        return None
    parts = x[: columns * length].reshape(columns, length)
    window = np.hanning(length)
    f = np.fft.rfftfreq(length, 1.0 / data.rate)
    power = np.abs(np.fft.rfft(window * (parts - parts.mean(axis=1, keepdims=True)))) ** 2
    power /= data.rate * np.sum(window**2)
    edges = np.linspace(low, high, CLOSE_ROWS + 1)
    first = np.searchsorted(f, edges)
    mean = np.add.reduceat(power[:, : first[-1]], first[:-1], axis=1) / np.diff(first)
    _, top = data.bins.limits(data.rate)
    own = np.searchsorted(top, 0.5 * (edges[1:] + edges[:-1]))
    expected = (fit.solution.spectrum / data.rate)[np.minimum(own, top.size - 1)]
    values = np.log2(np.maximum(mean / expected, 1e-6)).T
    limit = max(2.0, float(np.ceil(values.max())))
    ticks = ((-limit, f"≤ 1/{2**limit:g}"), (0.0, "1"), (limit, f"≥ {2**limit:g}"))
    size, name = time_scale(data.duration)
    times = np.arange(columns + 1) * length / data.rate / size
    marked = np.zeros(values.shape, dtype=bool)
    heat = HeatMap(times, edges, values, limit, "measured over expected power", ticks, marked)
    label = linear_axis(f"time ({name})", 0.0, data.duration / size, 8)
    y = linear_axis("frequency f (Hz)", low, high, 5)
    return Panel(label, y, (heat,), title="Close-up", grid=False)

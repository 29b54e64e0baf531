"""Figure of samples in a time range, down to single samples, with logged columns below."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.common.numbers import count_text, time_scale
from allanite.plots.axes import linear_axis
from allanite.plots.recording import column_panel, samples_panel, signal_line
from allanite.plots.spec import Band, Figure, Line, Mark, Points, Rule, Span

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.recording import Recording

#: Number of segments of the envelope of the samples, more than a screen can resolve.
SEGMENTS = 1600
#: Maximum number of samples that are drawn individually.
MAX_SINGLE = 3000
#: Maximum number of samples that are marked by points.
MAX_DOTS = 300


def samples_figure(
    log: Recording,
    options: Mapping[str, str],
    worst: tuple[float, float] | None,
    moments: Sequence[tuple[float, str]] = (),
    out: Sequence[tuple[float, float]] = (),
    drift: tuple[np.ndarray, str] | None = None,
) -> Figure:
    """`Figure` of the samples from ``options["from"]`` to ``options["to"]`` in s, with up to two logged columns below.

    Over 3000 samples are drawn as mean and range of 1600 segments. `worst` is the time range in s in which the model
    fails, `moments` are times of events with names, `out` the excluded segments, `drift` known functions of time and
    their names.
    """
    start, end = _time_range(log, options)
    first, last = int(start * log.rate), min(log.n, int(np.ceil(end * log.rate)) + 1)
    first, last = max(0, min(first, log.n - 4)), max(last, first + 4)
    part = log if last - first >= log.n else log.trim(first / log.rate, last / log.rate)
    size, name = time_scale(part.duration)
    begin = first / log.rate / size
    single = part.n <= MAX_SINGLE
    panel = samples_panel(part, segments=part.n if single else SEGMENTS)
    marks: list[Mark] = []
    if worst is not None and worst[1] > start and worst[0] < end:
        span = max(worst[0], start) / size, min(worst[1], end) / size
        marks.append(Span(*span, "fail", "when the model fails"))
    marks += [
        Span(max(a, start) / size, min(b, end) / size, "raw", "excluded")
        for a, b in out
        if b > start and a < end
    ]
    marks += [_shifted_mark(mark, begin) for mark in panel.marks]
    if part.n <= MAX_DOTS:
        line = next(m for m in marks if isinstance(m, Line))
        marks.append(Points(line.x, line.y, "c1", "single samples", size=3.5))
    if drift is not None:
        marks.append(signal_line(log, *drift, first, part.n))
    marks += [Rule(t / size, "x", "model", "dash", n) for t, n in moments if start <= t <= end]
    limits = (begin, begin + part.duration / size)
    x = linear_axis(f"time ({name})", *limits, 8)
    panels = [replace(panel, x=x, marks=tuple(marks), show_x=not part.covariates)]
    kept = list(part.covariates.items())[:2]
    for row, (column, values) in enumerate(kept, 1):
        panels.append(column_panel(part, column, values, x, row, row == len(kept), begin))
    each = part.n / SEGMENTS
    what = "all drawn" if single else f"mean, minimum and maximum of {each:.0f} samples each"
    heights = (2.0, *(1.0 for _ in kept))
    told = f"{count_text(part.n)} samples, {what}"
    return Figure("Samples", told, tuple(panels), heights, kind="samples")


def _time_range(log: Recording, options: Mapping[str, str]) -> tuple[float, float]:
    """Pair (start, end) of the options in s, limited to the record; by default all of it."""
    try:
        start = float(options.get("from") or 0.0)
        end = float(options.get("to") or log.duration)
    except ValueError:
        raise InputError("A time range needs two numbers, in seconds") from None
    start, end = max(0.0, start), min(log.duration, end)
    if not end > start:
        raise InputError("This time range contains no samples")
    return start, end


def _shifted_mark(mark: Mark, by: float) -> Mark:
    """Copy of a band, line or points shifted along the time axis; other marks unchanged."""
    return replace(mark, x=mark.x + by) if isinstance(mark, Band | Line | Points) else mark

"""Read captured edges of a pulse per second. The times of the edges give the phase of the clock."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import first_lines, numbered_lines
from allanite.recording.timebase import MAX_MISSING_RATIO

# Sources:
#   pps-tools, ppstest.c: "source 0 - assert 1516102326.992172280, sequence: 8108815 - clear  0.000000000, sequence: 0"
#   Linux, Documentation/driver-api/pps.rst: /sys/class/pps/pps0/assert holds "1170026870.983207967#8"
#   TAPR TICC, TICC.ino: "# timestamp (seconds)", then "1.123456789012 chA" a line
#   a column of times alone, with or without a name
_TIME = r"(?P<seconds>\d{1,10})[.,](?P<fraction>\d{3,12})"
#: Patterns of a line with the time of an edge; the last one is a time alone.
_LINE_PATTERNS = (
    re.compile(rf"source \d+ - assert {_TIME}, sequence: (?P<number>\d+)"),
    re.compile(rf"^{_TIME}#(?P<number>\d+)$"),
    re.compile(rf"^{_TIME}\s+(?P<channel>ch[A-D])\b"),
    re.compile(rf"^{_TIME}$"),
)
#: Minimum number of edges in the first lines with which a column of times is recognized. Chosen by judgment; not measured.
MIN_EDGES = 8
#: Maximum relative difference between the interval of the edges and a round period. Clocks with a pulse are more accurate.
MAX_PERIOD_ERROR = 1e-3
#: Picoseconds per second.
PICOSECONDS_PER_SECOND = 10**12


def recognizes(head: bytes) -> bool:
    """True if the first lines are times of the edges of a pulse (PPS), one edge per line.

    Bare numbers need at least 8 edges that rise by nearly whole multiples of a round period, not all steps being equal.
    """
    lines = first_lines(head)
    form = _line_pattern(lines)
    if form is None:
        return False
    if form is not _LINE_PATTERNS[-1]:
        return True
    # A single column of numbers may be anything. Edges rise by nearly one period each, an index by exactly 1.
    found = [m for line in lines if (m := form.match(line))]
    if len(found) < MIN_EDGES or len(found) < len(lines) - 1:
        return False
    times = [_picoseconds(m) for m in found]
    steps = np.diff([float(t - times[0]) for t in times]) / PICOSECONDS_PER_SECOND
    period = _round_period(float(np.median(steps)))
    return (
        period is not None
        and bool(np.all(steps > 0))
        and bool(np.any(steps != steps[0]))
        and _are_whole_periods(steps, period)
    )


def _are_whole_periods(steps: Array, period: float) -> bool:
    """True if all steps (s) are whole numbers of periods within 0.1 %."""
    periods = np.rint(steps / period)
    error = np.abs(steps / period - periods)
    return bool(np.all(error <= MAX_PERIOD_ERROR * np.maximum(periods, 1)))


def _line_pattern(lines: list[str]) -> re.Pattern[str] | None:
    """First of the known patterns that at least two of the lines match, or None."""
    return next(
        (form for form in _LINE_PATTERNS if sum(bool(form.search(line)) for line in lines) >= 2),
        None,
    )


def _picoseconds(found: re.Match[str]) -> int:
    """Time of an edge in ps, from a matched line."""
    return int(found["seconds"]) * PICOSECONDS_PER_SECOND + int(found["fraction"].ljust(12, "0"))


def _round_period(step: float) -> float | None:
    """Round period (1, 2 or 5 times a power of ten, s) within 0.1 % of a step in s, or None."""
    if not step > 0:
        return None
    power = 10.0 ** np.floor(np.log10(step))
    nearest = min((factor * power for factor in (1, 2, 5, 10)), key=lambda p: abs(step / p - 1))
    return float(nearest) if abs(step / nearest - 1) <= MAX_PERIOD_ERROR else None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the phase in s of pulses (PPS), one column per channel: time since its first edge minus whole periods.

    Periods without an edge are NaN. Shorter columns end with NaN. Raises `InputError` if channels have different
    periods. It is also raised for a channel with fewer than two edges or two edges in a period, for a period that is
    not round, and for text among the times.
    """
    form = _line_pattern(first_lines(head_of(path)))
    assert form is not None
    edges: dict[str, list[int]] = {}
    rows: dict[str, list[int]] = {}
    for row, line in numbered_lines(path):
        found = form.search(line)
        if found is not None:
            channel = found.groupdict().get("channel") or ""
            edges.setdefault(channel, []).append(_picoseconds(found))
            rows.setdefault(channel, []).append(row)
        elif form is _LINE_PATTERNS[-1] and edges and not line.startswith("#"):
            raise InputError(f"row {row} is not the time of an edge: {plain(line, 40)}")
    phases, notes = [], []
    for channel, times in edges.items():
        of = f" of {channel}" if channel else ""
        phase, period = _phase_and_period(np.array(times, dtype=object), rows[channel], of)
        phases.append((channel, phase, period))
        notes.append(f"the phase{of} is the time of each edge minus whole periods of {period:g} s")
    if len({period for _, _, period in phases}) > 1:
        raise InputError("the channels have different periods: write one file per channel")
    length = max(len(phase) for _, phase, _ in phases)
    columns = tuple(
        np.concatenate((phase, np.full(length - len(phase), np.nan))) for _, phase, _ in phases
    )
    names = tuple(f"phase_{channel}" if channel else "phase" for channel, _, _ in phases)
    return Table(names, columns, ("s",) * len(names), rate=1.0 / phases[0][2], notes=tuple(notes))


def _phase_and_period(times: NDArray[np.object_], rows: list[int], of: str) -> tuple[Array, float]:
    """Phase in s of each period, shape (n,), NaN without an edge; and the period in s.

    `times` are the edges in ps; `rows` and `of` are for messages. Raises `InputError` for fewer than two edges, a period
    that is not round, two edges in a period, or over 80 % of the periods without an edge.
    """
    if times.size < 2:
        raise InputError(f"only {times.size} edge{of}: a phase needs at least two edges")
    # Python integers are exact. Doubles resolve seconds since 1970 only to 0.2 µs.
    since = times - times[0]
    step = float(np.median(np.diff(since).astype(np.float64))) / PICOSECONDS_PER_SECOND
    period = _round_period(step)
    if period is None:
        raise InputError(
            f"the edges{of} are {step:.6g} s apart, which is not a round period: not the pulse of a clock"
        )
    whole = round(period * PICOSECONDS_PER_SECOND)
    # Periods are counted step by step, so that a clock with a frequency offset does not gain a period over a long record.
    steps = np.rint(np.diff(since).astype(np.float64) / whole).astype(np.int64)
    double = np.flatnonzero(steps < 1)
    if double.size:
        raise InputError(
            f"row {rows[int(double[0]) + 1]}: a second edge{of} within one period ({double.size} such edges in all):"
            " remove the false edges"
        )
    missing = steps - 1
    if missing.sum() > MAX_MISSING_RATIO * times.size:
        longest = int(np.argmax(missing))
        raise InputError(
            f"row {rows[longest + 1]}: {missing[longest]} periods without an edge before it, and only {times.size}"
            f" edges{of}: correct this time, or write one file for each run"
        )
    number = np.concatenate(([0], np.cumsum(steps)))
    phase = np.full(int(number[-1]) + 1, np.nan)
    phase[number] = (since - number.astype(object) * whole).astype(
        np.float64
    ) / PICOSECONDS_PER_SECOND
    return phase, period


FORMAT = LogFormat(
    "edges of a pulse per second (ppstest, sysfs, TICC, or a column of times)",
    read,
    recognizes=recognizes,
    reads="the phase: time of each edge minus whole periods",
)

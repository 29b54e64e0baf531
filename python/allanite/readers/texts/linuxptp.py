"""Read logs of linuxptp (ptp4l, phc2sys and ts2phc), as printed or as stored by syslog and journald."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import (
    chosen_source,
    date_times,
    first_lines,
    numbered_lines,
    spacing_notes,
)

# Source: linuxptp 4, clock.c, phc2sys.c and ts2phc.c print
#   "%s offset %10lld s%d freq %+7.0f path delay %10lld"   (ptp4l; "master offset" before 4.0)
#   "%s %s offset %9lld s%d freq %+7.0f delay %6lld"       (phc2sys: the clock, then phc or sys)
#   "%s offset %10lld s%d freq %+7.0f"                     (ts2phc)
# Offset and delay are in ns, the frequency in ppb; print.c puts "program[monotonic seconds]: [config] " before them.
_PROGRAM = re.compile(r"\b(?P<program>ptp4l|phc2sys|ts2phc)\b")
_SAMPLE = re.compile(
    r"\boffset\s+(?P<offset>[-+]?\d+)\s+s(?P<state>[0-3])\s+freq\s+(?P<freq>[-+]?\d+)"
    r"(?:\s+(?:path\s+)?delay\s+(?P<delay>[-+]?\d+))?"
)
_SECONDS = re.compile(r"\[(\d+\.\d+)\]")
# A line with a summary of several offsets.
_SUMMARY = re.compile(r"\brms\s+\d+\s+max\s+\d+\s+freq\b")
#: Lowest state of a locked servo. 0: unlocked, 1: the clock is stepped, 2: locked, 3: locked and stable.
LOCKED = 2


def recognizes(head: bytes) -> bool:
    """True if the first lines contain a line of ptp4l, phc2sys or ts2phc with samples, a summary or a time."""
    lines = [line for line in first_lines(head) if _PROGRAM.search(line)]
    return any(
        _SAMPLE.search(line) or _SUMMARY.search(line) or _SECONDS.search(line) for line in lines
    )


def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a log of linuxptp: offset of a clock in s, its frequency in ppb, path delay in s (NaN if not logged).

    Of several clocks, the one in `topics` is read, or else the one with the most lines. The samples before the servo
    first locks (state s2) are excluded, because the servo steps the clock there. If the servo never locks, all samples are
    kept. Raises `InputError` without offsets, for an offset without a time, for several topics, and for an unknown one.
    """
    rows: dict[str, list[tuple[str, ...]]] = {}
    summaries = 0
    for number, line in numbered_lines(path):
        program = _PROGRAM.search(line)
        if program is None:
            continue
        found = _SAMPLE.search(line)
        if found is None:
            summaries += _SUMMARY.search(line) is not None
            continue
        seconds = _SECONDS.search(line)
        if seconds is None:
            raise InputError(
                f"row {number} has an offset without the seconds in brackets ([1234.567]) that linuxptp prints"
            )
        # The name of the clock is the text between program and offset, without text in brackets.
        between = re.sub(r"\[[^\]]*\]|:(?=\s|$)", " ", line[program.end() : found.start()])
        clock = " ".join([program["program"], *between.split()])
        numbers = (found[k] for k in ("offset", "state", "freq", "delay"))
        rows.setdefault(clock, []).append((seconds[1], *(n or "nan" for n in numbers)))
    if not rows and summaries:
        raise InputError(
            f"{summaries} lines with summaries (rms, max), but no offsets: set summary_interval to 0 in ptp4l, or use"
            " -u 0 in phc2sys"
        )
    if not rows:
        raise InputError("no line with an offset in this log of linuxptp")
    chosen, others = chosen_source(rows, topics, "clock")
    values = np.array(rows[chosen], dtype=np.float64)
    notes = [f"the offset of {plain(chosen)} is the phase", *others]
    locked = values[:, 2] >= LOCKED
    first = int(np.argmax(locked)) if locked.any() else 0
    if first:
        notes.append(f"{first} samples before the servo locked (s0, s1) are excluded")
        values, locked = values[first:], locked[first:]
    if locked.any() and not locked.all():
        notes.append(f"the servo was not locked at {np.count_nonzero(~locked)} later samples")
    time, offset, _, frequency, delay = values.T
    notes += spacing_notes(time)
    return Table(
        ("offset", "frequency", "delay"),
        (offset * 1e-9, frequency, delay * 1e-9),
        ("s", "ppb", "s"),
        time=date_times(time),
        notes=tuple(notes),
    )


FORMAT = LogFormat(
    "ptp4l, phc2sys, ts2phc",
    read,
    recognizes=recognizes,
    has_topics=True,
    reads="the offset as the phase of the clock",
)

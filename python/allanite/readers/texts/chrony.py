"""Read logs of chronyd: tracking.log, statistics.log, measurements.log and refclocks.log."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import chosen_source, numbered_lines, spacing_notes

# Source: chrony.conf(5), "log"; reference.c, sourcestats.c, ntp_core.c and refclock.c print a banner of three lines every
# 32 rows.
# Kind of log → words that only its banner has, and (name, unit, field) of the numbers that are read.
_KINDS: dict[str, tuple[bytes, tuple[tuple[str, str, int], ...]]] = {
    "tracking": (
        b"Offset L Co",
        (("offset", "s", 6), ("frequency", "ppm", 4), ("skew", "ppm", 5)),
    ),
    "statistics": (b"Est offset", (("offset", "s", 4), ("offset_std", "s", 5))),
    "measurements": (b"LP RP Score", (("offset", "s", 11), ("peer_delay", "s", 12))),
    "refclocks": (b"Cooked offset", (("offset", "s", 7),)),
}
_ROW = re.compile(r"^\d{4}-\d\d-\d\d$")


def _kind_of_log(head: bytes) -> str | None:
    """Kind of a log of chronyd (``tracking``, ``statistics``, ``measurements`` or ``refclocks``) or None."""
    if b"Date (UTC) Time" not in head:
        return None
    return next((kind for kind, (words, _) in _KINDS.items() if words in head), None)


def recognizes(head: bytes) -> bool:
    """True if the first lines contain the column titles of one of four logs of chronyd."""
    return _kind_of_log(head) is not None


def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a log of chronyd: offset of the clock in s as the first column; other columns depend on the kind of log.

    Of several sources, the one in `topics` is read, or else the one with the most rows. Without topics, all rows of
    ``tracking`` are read, in order of time. Medians in ``refclocks`` are skipped. Raises `InputError` for an incomplete
    row, no row, several topics, or an unknown one.
    """
    kind = _kind_of_log(head_of(path))
    assert kind is not None
    fields = _KINDS[kind][1]
    rows: dict[str, list[tuple[np.datetime64, list[float]]]] = {}
    for number, line in numbered_lines(path):
        cells = line.split()
        # A source "-" is the median of the samples before it.
        if not _ROW.match(cells[0]) or (kind == "refclocks" and cells[3:4] == ["-"]):
            continue
        try:
            moment = np.datetime64(f"{cells[0]}T{cells[1]}", "ns")
            values = [float(cells[at]) for _, _, at in fields]
        except (IndexError, ValueError):
            raise InputError(f"row {number} is not a complete row of chrony's {kind}.log") from None
        rows.setdefault(cells[2], []).append((moment, values))
    if not rows:
        raise InputError(f"no row in this {kind}.log of chrony")
    if kind == "tracking" and not topics:
        # All rows are about the local clock, although its source may change.
        found = sorted((row for of in rows.values() for row in of), key=lambda row: row[0])
        notes = ["the offset is the phase of the local clock against its source"]
        if len(rows) > 1:
            notes.append(f"the source changes: {plain(', '.join(rows), 200)}")
    else:
        source, others = chosen_source(rows, topics, "source")
        found = rows[source]
        notes = [f"the offset against {plain(source)} is the phase", *others]
    numbers = np.array([values for _, values in found])
    moments = np.array([row[0] for row in found])
    notes += spacing_notes((moments - moments[0]) / np.timedelta64(1, "s"))
    columns = [(name, x, unit) for (name, unit, _), x in zip(fields, numbers.T, strict=True)]
    return Table.of(columns, time=moments, notes=tuple(notes))


FORMAT = LogFormat(
    "chrony: tracking, statistics, measurements and refclocks",
    read,
    recognizes=recognizes,
    has_topics=True,
    reads="the offset as the phase of the clock",
)

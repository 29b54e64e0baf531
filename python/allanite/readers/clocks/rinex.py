"""Read RINEX clock files: offsets of satellite and receiver clocks."""

from __future__ import annotations

import math
from array import array
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.readers._format import LogFormat
from allanite.readers._lines import lines_of
from allanite.readers._table import Picker, Table, check_shape


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a RINEX clock file: clock offsets in s, one column per clock in order of appearance; epochs are the time.

    Epochs are sorted; an epoch without a value of a clock is NaN. For a repeated epoch, the last offset counts. Raises
    `InputError` for an invalid record, and without records. The format is RINEX Extensions to Handle Clock Information,
    version 3.04: records AR (receiver) and AS (satellite).
    """
    clocks: dict[str, tuple[array[int], array[float]]] = {}
    body = False
    with path.open("rb") as stream:
        for number, line in enumerate(lines_of(stream), start=1):
            if not body:
                body = b"END OF HEADER" in line
            elif line[:3] in (b"AR ", b"AS "):
                cells = line.decode("ascii", "replace").split()
                try:
                    year, month, day, hour, minute = (int(cell) for cell in cells[2:7])
                    date = f"{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}"
                    fraction = round(float(cells[7]) * 1e6)
                    offset = float(cells[9].replace("D", "E").replace("d", "e"))
                    when = np.datetime64(date, "us") + np.timedelta64(fraction, "us")
                except (ValueError, OverflowError, IndexError):
                    shown_line = line.decode("ascii", "replace").strip()[:60]
                    raise InputError(f"line {number}: not a clock record: {shown_line!r}") from None
                epochs, offsets = clocks.setdefault(cells[1], (array("q"), array("d")))
                epochs.append(int(when.astype(np.int64)))
                offsets.append(offset)
    if not clocks:
        raise InputError(
            "no clock record (AS or AR after END OF HEADER): damaged, or not a RINEX clock file"
        )
    times = np.unique(np.concatenate([epochs for epochs, _ in clocks.values()]))
    check_shape((times.size, len(clocks)))
    require_memory(8.0 * times.size * len(clocks), f"{len(clocks)} clocks at {times.size} epochs")
    columns = []
    for epochs, offsets in clocks.values():
        column = np.full(times.size, math.nan)
        # For a repeated epoch, the last offset counts.
        column[np.searchsorted(times, epochs)] = offsets
        columns.append(column)
    return Table(
        tuple(clocks), tuple(columns), ("s",) * len(clocks), time=times.astype("datetime64[us]")
    )


FORMAT = LogFormat(
    "RINEX clock file",
    read,
    suffixes=(".clk",),
    reads="the offset of each clock",
)

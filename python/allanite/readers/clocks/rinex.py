"""RINEX CLK: the offsets of satellite and receiver clocks at epochs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._table import Table

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker

__all__ = ["read"]


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read the clock offsets, s, one column a clock; where a clock lacks an epoch, the sample is missing.

    Raises
    ------
    InputError
        A bad record, named by its line, or none at all.

    Notes
    -----
    RINEX Extensions to Handle Clock Information, version 3.04: records AR (receiver) and AS (satellite).
    """
    clocks: dict[str, dict[np.datetime64, float]] = {}
    body = False
    with path.open(encoding="ascii", errors="replace") as lines:
        for number, line in enumerate(lines, start=1):
            if not body:
                body = "END OF HEADER" in line
            elif line[:3] in ("AR ", "AS "):
                cells = line.split()
                try:
                    year, month, day, hour, minute = (int(cell) for cell in cells[2:7])
                    date = f"{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}"
                    fraction = round(float(cells[7]) * 1e6)
                    offset = float(cells[9].replace("D", "E").replace("d", "e"))
                    when = np.datetime64(date, "us") + np.timedelta64(fraction, "us")
                except (ValueError, IndexError):
                    raise InputError(
                        f"line {number}: not a clock record: {line.strip()[:60]!r}"
                    ) from None
                clocks.setdefault(cells[1], {})[when] = offset
    if not clocks:
        raise InputError(
            "no clock in it (records AS and AR after END OF HEADER): damaged, or not RINEX CLK"
        )
    epochs = np.array(sorted(set().union(*clocks.values())))
    columns = tuple(
        np.array([offsets.get(epoch, math.nan) for epoch in epochs.tolist()])
        for offsets in ({k.item(): v for k, v in own.items()} for own in clocks.values())
    )
    return Table(tuple(clocks), columns, ("s",) * len(clocks), time=epochs)

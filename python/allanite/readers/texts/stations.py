"""Read daily positions of a GNSS station: ``.tenv`` and ``.tenv3`` of the Nevada Geodetic Laboratory (UNR)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import MJD_OF_1970, date_times, first_lines, numbered_lines

# Source: geodesy.unr.edu, README_tenv.txt and README_tenv3.txt. Fields are separated by blanks.
#   both: station, date (YYMMMDD), decimal year, MJD, GPS week, day of the week
#   tenv: east, north, up, antenna height, three standard deviations, three correlations; lengths in m
#   tenv3: longitude of the reference meridian, then whole and fractional part of east, north and up, m
_ROW = re.compile(
    r"^\S{4} +\d\d[A-Z]{3}\d\d +\d{4}\.\d+ +(?P<day>\d{5}(?:\.\d+)?) +\d+ +\d +(?P<rest>.+)$"
)
_HEADER = re.compile(r"^site +YYMMMDD +yyyy\.yyyy +__MJD ")
#: Minimum number of fields after the day of the week.
TENV, TENV3 = 10, 13


def recognizes(head: bytes) -> bool:
    """True if the first line is a row of a tenv file, or the header of a tenv3 file."""
    lines = first_lines(head)
    return bool(lines) and (_HEADER.match(lines[0]) is not None or _ROW.match(lines[0]) is not None)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a GNSS station file (tenv, tenv3): east, north and up of each day with its date.

    The positions are in m, which a note states; the units of the columns are None. In a tenv3 file, whole meters and
    fractions are added. Raises `InputError` for a row of another form, length or station, for text, and without rows.
    """
    days: list[float] = []
    values: list[list[float]] = []
    whole = False
    width, station = 0, ""
    for number, text in numbered_lines(path):
        if number == 1 and _HEADER.match(text):
            whole = True
            continue
        found = _ROW.match(text)
        cells = [] if found is None else found["rest"].split()
        width = width or len(cells)
        if found is None or len(cells) != width or width < (TENV3 if whole else TENV):
            raise InputError(f"row {number} is not a row of a tenv file: {plain(text, 60)}")
        station = station or text[:4]
        if text[:4] != station:
            raise InputError(
                f"row {number} belongs to station {plain(text[:4])}, earlier rows to {plain(station)}: write one file"
                " per station"
            )
        days.append(float(found["day"]))
        try:
            values.append([float(cell) for cell in cells[:TENV]])
        except ValueError:
            raise InputError(
                f"row {number} holds text where a number belongs: {plain(text, 60)}"
            ) from None
    if not values:
        raise InputError("the tenv file has no rows")
    table = np.array(values)
    columns = (
        [table[:, 1 + 2 * k] + table[:, 2 + 2 * k] for k in range(3)]
        if whole
        else list(table[:, :3].T)
    )
    return Table(
        ("east", "north", "up"),
        tuple(columns),
        (None,) * 3,
        time=date_times(86400.0 * (np.array(days) - MJD_OF_1970)),
        notes=(f"positions of the station {plain(station)} are in m",),
    )


FORMAT = LogFormat(
    "UNR `.tenv` and `.tenv3`",
    read,
    recognizes=recognizes,
    reads="east, north and up, one sample a day",
)

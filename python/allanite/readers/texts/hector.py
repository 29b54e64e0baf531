"""Read series of Hector and other geodetic programs (.mom): Modified Julian Dates and observations."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers import text
from allanite.readers._format import LogFormat
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import MJD_OF_1970, date_times

# Source: Hector user manual, "mom format": "# sampling period 1.0" (days), lines of "# offset" and other events, then MJD,
# the observation and, if one was estimated, the model.
_OFFSET = re.compile(r"^#\s*offset\s+(?P<day>\S+)", re.IGNORECASE)
_PERIOD = re.compile(rb"^#\s*sampling\s+period\s+[0-9.]+", re.IGNORECASE | re.MULTILINE)


def recognizes(head: bytes) -> bool:
    """True if a comment states the sampling period as in Hector series (``# sampling period 1.0``)."""
    return _PERIOD.search(head) is not None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - the format fixes the columns
    """`Table` of a Hector series: one column of observations without unit, and their dates as the time.

    Days without an observation have no row. A third column of the file (the model) is not used. Raises `InputError`
    unless the file has two or three columns, all of numbers.
    """
    table = text.read(path, text.all_numbers)
    if not 2 <= len(table.columns) <= 3 or table.texts:
        raise InputError(
            f"{len(table.columns) - len(table.texts)} columns of numbers and {len(table.texts)} of text, but a file of"
            " Hector has two or three of numbers: date (MJD), observation, model"
        )
    return replace(
        table,
        names=("observation",),
        columns=(table[1],),
        units=(None,),
        named=True,
        texts={},
        dates=frozenset(),
        source="file",
        time=date_times(86400.0 * (table[0] - MJD_OF_1970)),
        notes=("the unit of the observations is that of the file, often 1 mm",),
    )


def offsets_of(path: Path) -> list[str]:
    """Dates (ISO 8601) of the lines ``# offset MJD`` of a Hector series; empty for other files.

    Raises `InputError` if such a line has no Modified Julian Date of the years 1678 to 2262.
    """
    head = head_of(path) if path.is_file() else b""
    if not recognizes(head):
        return []
    matches = (_OFFSET.match(line.strip()) for line in head.decode("utf-8", "replace").splitlines())
    return [str(_date_of_mjd(m["day"]).astype("datetime64[s]")) for m in matches if m is not None]


def _date_of_mjd(day: str) -> np.datetime64:
    """Date-time (datetime64[ns]) of a text with a Modified Julian Date; raises `InputError` if it is none."""
    try:
        [moment] = date_times([86400.0 * (float(day) - MJD_OF_1970)])
    except ValueError:  # also the InputError of a date that is out of range
        raise InputError(f"the offset {plain(day, 40)} is not a Modified Julian Date") from None
    return moment


FORMAT = LogFormat(
    "Hector (`.mom`)",
    read,
    recognizes=recognizes,
    reads="the observations, one sample each sampling period",
)

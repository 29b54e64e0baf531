"""Series of Hector and other geodetic programs (.mom): Modified Julian Dates and observations."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.readers import text
from allanite.readers.texts._lines import MJD_OF_1970, date_times

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker, Table

__all__ = ["read", "recognizes"]

# Source: Hector user manual, "mom format": "# sampling period 1.0" (days), lines of "# offset" and other events, then MJD,
# the observation and, if one was estimated, the model.
_PERIOD = re.compile(rb"^#\s*sampling\s+period\s+[0-9.]+", re.IGNORECASE | re.MULTILINE)


def recognizes(head: bytes) -> bool:
    """Whether a comment states the sampling period in days."""
    return _PERIOD.search(head) is not None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - the format fixes the columns
    """Read the observations; days without one are missing samples.

    Raises
    ------
    InputError
        Not two or three columns.
    """
    table = text.read(path, text.all_numbers)
    if table.named or not 2 <= len(table.columns) <= 3 or table.texts:
        raise InputError(
            f"{len(table.columns)} columns, where a file of Hector has the date (MJD), the observation and a model"
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

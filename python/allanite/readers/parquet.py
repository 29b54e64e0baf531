"""Parquet and Arrow (Feather) files, by pyarrow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.readers.frame import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker, Table

__all__ = ["read"]


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read the numeric columns; one of date-times is the time.

    Raises
    ------
    InputError
        A damaged or truncated file, or no numeric column in it.
    """
    import pyarrow as pa
    from pyarrow import feather
    from pyarrow import parquet as files

    try:
        with path.open("rb") as stream:
            packed = stream.read(4) == b"PAR1"
        table = files.read_table(path) if packed else feather.read_table(str(path))
        # Offsets of a damaged column of text may ask for gigabytes.
        table.validate(full=True)
    except (pa.ArrowException, OSError) as error:
        text = " ".join(str(error).split())[:200]
        raise InputError(f"damaged or not a Parquet or Arrow file ({text})") from None
    return table_of(table)

"""TimeLab's text files (.tim): time errors in a block ``TIC rows columns``, what was measured before it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._table import Table

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker

__all__ = ["read"]

_BLOCK = re.compile(rb"^TIC[ \t]+(\d+)[ \t]+(\d+)[ \t]*\r?$", re.MULTILINE)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read the time errors, s, one column a channel. The interval is not in the block: `rate` says it.

    Raises
    ------
    InputError
        No such block, or one that ends before its last row.
    """
    content = path.read_bytes()
    found = _BLOCK.search(content)
    if found is None:
        raise InputError(
            "no block of time errors (TIC) in it: not a TimeLab file, or one of another version;"
            " export ASCII phase data in TimeLab and read that"
        )
    rows, columns = int(found[1]), int(found[2])
    cells = content[found.end() :].split(maxsplit=rows * columns)[: rows * columns]
    if columns < 1 or len(cells) < rows * columns:
        raise InputError(
            f"the block of time errors ends after {len(cells)} of {rows} × {columns} numbers: cut off"
        )
    try:
        values = np.array(cells, dtype=np.float64).reshape(rows, columns)
    except ValueError as error:
        raise InputError(f"the block of time errors holds text ({error})") from None
    names = ("phase",) if columns == 1 else tuple(f"phase_{k}" for k in range(1, columns + 1))
    return Table(names, tuple(values.T), ("s",) * columns)

"""Read text files of TimeLab (.tim): time errors in a block ``TIC rows columns``, after a description."""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table, check_shape

#: Number of first bytes in which the block of time errors must begin. TimeLab writes about a hundred lines before it.
HEAD = 1 << 20
#: Number of bytes per read, and maximum length of the text of one number.
BLOCK, MAX_NUMBER_LENGTH = 1 << 22, 400

_BLOCK = re.compile(rb"^TIC[ \t]+(\d+)[ \t]+(\d+)[ \t]*\r?$", re.MULTILINE)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a TimeLab file: time errors in s, named ``phase``, or ``phase_1``, ``phase_2``, … for several channels.

    Raises `InputError` if the block of numbers is missing or incomplete.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD)
        found = _BLOCK.search(head)
        if found is None:
            raise InputError(
                "no block of time errors (TIC): not a TimeLab file, or of another version; export ASCII phase data in"
                " TimeLab and read that file"
            )
        rows, columns = int(found[1]), int(found[2])
        stream.seek(found.end())
        values = _read_numbers(stream, rows * columns)
    if columns < 1 or values.size < rows * columns:
        raise InputError(
            f"truncated: the block of time errors ends after {values.size} of {rows} × {columns} numbers"
        )
    check_shape((rows, columns))
    values = values.reshape(rows, columns)
    names = ("phase",) if columns == 1 else tuple(f"phase_{k}" for k in range(1, columns + 1))
    return Table(names, tuple(values.T), ("s",) * columns)


def _read_numbers(stream: IO[bytes], count: int) -> Array:
    """The next `count` numbers of an open text file; fewer if the file ends.

    Raises `InputError` for text instead of numbers, also for a cell over `MAX_NUMBER_LENGTH` bytes.
    """
    found: list[Array] = []
    missing, rest = count, b""
    while missing > 0 and (block := stream.read(BLOCK)):
        # The last cell may continue in the next block. In the last block, a line end shows that the cell is complete.
        cells = (rest + block).split()
        rest = b"" if block[-1:].isspace() else cells.pop() if cells else b""
        if len(rest) > MAX_NUMBER_LENGTH:
            raise InputError("the block of time errors holds text, or binary data")
        missing -= _append_numbers(found, cells[:missing])
    # A last cell without a line end only counts if no other number is missing.
    if missing == 1 and rest:
        _append_numbers(found, [rest])
    return np.concatenate(found) if found else np.empty(0)


def _append_numbers(found: list[Array], cells: list[bytes]) -> int:
    """Append an array of the numbers in `cells` to `found`; return their count.

    Raises `InputError` if a cell is no number or the memory budget is exceeded.
    """
    try:
        found.append(np.array(cells, dtype=np.float64))
    except ValueError as error:
        raise InputError(f"the block of time errors holds text ({error})") from None
    # The numbers are held twice: in blocks and as one array.
    require_memory(2.0 * sum(block.nbytes for block in found), "the time errors")
    return len(cells)


FORMAT = LogFormat(
    "TimeLab",
    read,
    suffixes=(".tim",),
    reads="the time errors of the block `TIC`",
)

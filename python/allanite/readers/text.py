"""Text logs: delimiter, header, comment lines and decimal comma are found by themselves."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from allanite.errors import InputError
from allanite.readers._table import Table, split_unit

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["read"]

COMMENTS = ("#", "%", "//", "!")


def read(path: Path) -> Table:
    """Read the numeric columns of a text log.

    Raises
    ------
    InputError
        A cell that is no number, a row of another length; names file, row, column and text.
    """
    raw = path.read_bytes()
    if b"\0" in raw[:4096]:
        raise InputError(
            f"{path}: not a text log but binary data; known are text, NPY, NPZ, MAT, bag, ULog"
        )
    lines = raw.decode("utf-8-sig", errors="replace").splitlines()
    rows = [
        (i, s)
        for i, line in enumerate(lines, 1)
        if (s := line.strip()) and not s.startswith(COMMENTS)
    ]
    if not rows:
        raise InputError(f"{path}: no rows of numbers in it")
    sample = rows[len(rows) // 2][1]
    delimiter = next((d for d in ("\t", ";", "|") if d in sample), None)
    tokens = sample.split()
    spaced = len(tokens) > 1 and all(token.count(",") <= 1 and token[-1] != "," for token in tokens)
    if delimiter is None and not spaced:
        delimiter = "," if "," in sample else None
    comma = delimiter != "," and "," in sample
    split = [[cell.strip().strip('"') for cell in s.split(delimiter)] for _, s in rows]
    header = None
    if any(_number(cell, comma) is None for cell in split[0]):
        header = split.pop(0)
        line = rows.pop(0)[1]
        if delimiter is None and split and len(header) != len(split[0]):
            # A unit in brackets, or a single name, may itself hold a blank.
            header = re.findall(r"\S+(?:\s+[\[(][^\])]*[\])])?", line)
            header = [line] if len(split[0]) == 1 else header
    if not split:
        raise InputError(f"{path}: no rows of numbers in it")
    k = len(split[0]) if header is None else len(header)
    data = np.empty((len(split), k))
    for at, cells in enumerate(split):
        if len(cells) != k:
            raise InputError(f"{path}: row {rows[at][0]} has {len(cells)} columns, the others {k}")
        for j, cell in enumerate(cells):
            value = _number(cell, comma)
            if value is None:
                name = header[j] if header else str(j)
                raise InputError(
                    f"{path}: row {rows[at][0]}, column {name}: {cell!r} is not a number"
                )
            data[at, j] = value
    named = header is not None
    cells = header or [f"x{i}" for i in range(k)]
    pairs = [split_unit(cell) for cell in cells]
    names = ("x",) if header is None and k == 1 else tuple(name for name, _ in pairs)
    return Table(names, data, tuple(unit for _, unit in pairs), named=named)


def _number(cell: str, comma: bool) -> float | None:
    if not cell or cell.lower() in ("nan", "na", "null", "none", "n/a"):
        return float("nan")
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return None

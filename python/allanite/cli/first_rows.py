"""Which column of rows that come one by one is watched: told by the header and the first of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import numpy as np

from allanite.common.errors import MOST, InputError
from allanite.common.plain import plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.readers._table import Table

__all__ = ["ROWS", "cells_of", "has_numbers", "place_of"]

#: Rows that tell what is time where no header does.
ROWS = 100


def cells_of(line: str) -> list[str]:
    """Cells of a row; semicolons and tabs part numbers that may have decimal commas."""
    line = line.strip("\r\n ")
    mark = next((mark for mark in ";\t," if mark in line), None)
    return [cell.strip() for cell in line.split(mark)]


def has_numbers(line: str) -> bool:
    """Whether a line is a row: no comment, and as many numbers as words at least."""
    if line.lstrip().startswith("#"):
        return False
    cells = [cell for cell in cells_of(line) if cell]
    return bool(cells) and 2 * sum(not np.isnan(_number(cell)) for cell in cells) >= len(cells)


def place_of(lines: Sequence[str], asked: str | None, named: str, source: str) -> int:
    """Index of the column to watch.

    Parameters
    ----------
    lines : sequence of str
        The first lines, with the header if there is one.
    asked : str or None
        Name or number that was asked for.
    named : str
        Name that the model's file has; taken if there is such a column.
    source : str
        What the lines are of, for what is said.

    Raises
    ------
    InputError
        An unknown column, one of time stamps, or binary data.
    """
    from allanite.readers.columns import Request, choose, roles_of
    from allanite.recording import find_column

    if any("\0" in line for line in lines):
        raise InputError("binary data: rows of text are watched, one number or more in a line")
    table = _table(lines)
    if table is None:
        return 0
    names = table.names
    request = Request()
    roles = roles_of(table, request)
    if asked is not None or named in names:
        at = find_column(named if asked is None else asked, names)
        if at in roles.clocks or roles.roles[at] == "time":
            raise InputError(
                f"column {names[at]} holds time stamps: name that of the sensor with --column"
                f" ({', '.join(names)})"
            )
        return at
    samples = choose(table, roles, request).samples
    # Names of frames and the like are no numbers; without names what never changes may be anything.
    sensors = [i for i in samples if _may_be_one(table, i)] or [samples[0]]
    if len(sensors) > 1:
        said = f"column {names[sensors[0]]} is watched (--column NAME takes another)"
        several = ", ".join(names[i] for i in sensors)
        click.echo(plain(f"· {source}: {said}, of {several}", MOST), err=True)
    return sensors[0]


def _may_be_one(table: Table, at: int) -> bool:
    numbers = table[at][~np.isnan(table[at])]
    return numbers.size > 0 and (table.named or bool(numbers.min() < numbers.max()))


def _table(lines: Sequence[str]) -> Table | None:
    """The first rows as a table with the names of the header, or made-up ones."""
    from allanite.readers._table import Table, split_header

    first = next((i for i, line in enumerate(lines) if has_numbers(line)), None)
    if first is None:
        return None
    rows = [cells_of(line) for line in lines[first:] if has_numbers(line)]
    width = len(rows[0])
    numbers = np.array([[_number(cell) for cell in row] for row in rows if len(row) == width])
    heads = [cells_of(line.strip().lstrip("#%")) for line in lines[:first] if line.strip()]
    header = next((cells for cells in reversed(heads) if len(cells) == width and any(cells)), None)
    columns = tuple(numbers.T)
    if header is None:
        names = ("x",) if width == 1 else tuple(f"x{i}" for i in range(width))
        return Table(names, columns, (None,) * width, named=False)
    names, units = split_header(header)
    return Table(names, columns, units)


def _number(cell: str) -> float:
    """NaN for what is none."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return np.nan

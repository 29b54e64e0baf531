"""Choose the column to watch from the first lines of a source."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import numpy as np

from allanite.common.errors import MAX_MESSAGE_LENGTH, InputError
from allanite.common.plain import plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.readers._table import Table

__all__ = ["FIRST_ROWS", "cells_of", "column_index", "has_numbers"]

#: Rows of numbers from which the columns are recognized. Without a header, this many rows show which column is time.
#: Chosen by judgment; not measured.
FIRST_ROWS = 100


def cells_of(line: str) -> list[str]:
    """Cells of a row. In rows with semicolons or tabs, a comma is a decimal comma."""
    line = line.strip("\r\n ")
    mark = next((mark for mark in ";\t," if mark in line), None)
    return [cell.strip() for cell in line.split(mark)]


def has_numbers(line: str) -> bool:
    """True if a line is a row of samples: no comment, and at least half of the filled cells are numbers."""
    if line.lstrip().startswith("#"):
        return False
    cells = [cell for cell in cells_of(line) if cell]
    return bool(cells) and 2 * sum(not np.isnan(_number(cell)) for cell in cells) >= len(cells)


def column_index(lines: Sequence[str], column: str | None, model_column: str, source: str) -> int:
    """Index of the column to watch.

    Parameters
    ----------
    lines : sequence of str
        The first lines, with the header if there is one.
    column : str or None
        Name or number that the user gave.
    model_column : str
        Name of the column in the model file. Used if the source has a column of this name.
    source : str
        Name of the source, for messages.

    Raises
    ------
    InputError
        The column is unknown or holds time stamps, or the data are binary.
    """
    from allanite.readers.columns import Request, choose, roles_of
    from allanite.recording import find_column

    if any("\0" in line for line in lines):
        raise InputError(
            "binary data: the source must be text, with one number or more in each line"
        )
    table = _table(lines)
    if table is None:
        return 0
    names = table.names
    request = Request()
    roles = roles_of(table, request)
    if column is not None or model_column in names:
        at = find_column(model_column if column is None else column, names)
        if at in roles.clocks or roles.roles[at] == "time":
            raise InputError(
                f"column {names[at]} holds time stamps: choose a sensor column with --column"
                f" ({', '.join(names)})"
            )
        return at
    samples = choose(table, roles, request).samples
    sensors = [i for i in samples if _may_be_sensor(table, i)] or [samples[0]]
    if len(sensors) > 1:
        others = ", ".join(names[i] for i in sensors[1:])
        note = f"· {source}: watching column {names[sensors[0]]}; others: {others} (choose with --column NAME)"
        click.echo(plain(note, MAX_MESSAGE_LENGTH), err=True)
    return sensors[0]


def _may_be_sensor(table: Table, at: int) -> bool:
    """True if a column has numbers and, in a table without names, if the numbers change."""
    numbers = table[at][~np.isnan(table[at])]
    return numbers.size > 0 and (table.named or bool(numbers.min() < numbers.max()))


def _table(lines: Sequence[str]) -> Table | None:
    """Table of the first rows, with the names in the header or x0, x1, …; None without any row."""
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
    """The number in a cell; NaN if the cell holds none."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return np.nan

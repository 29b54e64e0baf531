"""Choose the column to watch, and the unit of its numbers, from the first lines of a source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click
import numpy as np

from allanite.common.errors import MAX_MESSAGE_LENGTH, InputError
from allanite.common.plain import plain

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import BinaryIO

    from allanite.cli.models import NamedModel
    from allanite.readers._table import Table
    from allanite.readers.columns import Roles

#: Rows of numbers from which the columns are recognized. Without a header, this many rows show which column is time.
#: Chosen by judgment; not measured.
FIRST_ROWS = 100


def cells_of(line: str) -> list[str]:
    """List of the cells of a row: texts without blanks at their ends.

    If the row contains a semicolon, semicolons separate the cells. Otherwise tabs do, then commas, then blanks. A comma
    in a row with semicolons or tabs is therefore a decimal comma.
    """
    line = line.strip("\r\n ")
    mark = next((mark for mark in ";\t," if mark in line), None)
    return [cell.strip() for cell in line.split(mark)]


def has_numbers(line: str) -> bool:
    """True if a line is a row of samples: no comment (#), and at least half of its filled cells are numbers.

    False for an empty line.
    """
    if line.lstrip().startswith("#"):
        return False
    cells = [cell for cell in cells_of(line) if cell]
    return bool(cells) and 2 * sum(not np.isnan(_number_of_cell(cell)) for cell in cells) >= len(
        cells
    )


@dataclass(frozen=True, slots=True)
class WatchedColumn:
    """A column of a source.

    Attributes
    ----------
    index : int
        Index of the column.
    factor : float
        Factor that converts its numbers to the unit of the model.
    """

    index: int
    factor: float = 1.0


def first_lines_of(file: BinaryIO, end: int) -> bytes:
    """Bytes of the first lines of a file before position `end`: the header, and at most 100 rows of numbers.

    The position in the file changes.
    """
    file.seek(0)
    lines, rows = [], 0
    while rows < FIRST_ROWS and file.tell() < end:
        line = file.readline(end - file.tell())
        lines.append(line)
        rows += has_numbers(line.decode("utf-8", "replace"))
    return b"".join(lines)


def watched_column(
    lines: Sequence[str],
    column: str | None,
    model: NamedModel,
    unit: str | None,
    quantity: str,
    source: str,
) -> WatchedColumn:
    """`WatchedColumn`: index of the column to watch, and the factor that converts its numbers to the unit of the model.

    The unit of the numbers is that in the header, otherwise the given one, otherwise that of the log to which the model
    was fitted. Without a row of numbers: the first column, factor 1.

    Parameters
    ----------
    lines : sequence of str
        The first lines, with the header if there is one.
    column : str or None
        Name or number that the user gave.
    model : NamedModel
        The column of its file is watched if the source has a column of this name.
    unit : str or None
        Unit that the user gave.
    quantity : str
        Meaning of the samples: ``rate``, ``increment`` or ``angle``.
    source : str
        Name of the source, for messages.

    Raises
    ------
    InputError
        The column is unknown or holds time stamps, its unit contradicts the given one, or the data are binary.
    """
    from allanite.readers.columns import Request, roles_of

    if any("\0" in line for line in lines):
        raise InputError(
            "binary data: the source must be text, with one number or more in each line"
        )
    table = _table_of_lines(lines)
    if table is None:
        return WatchedColumn(0)
    roles = roles_of(table, Request())
    at = _column_index(table, roles, column, model.column, source)
    if table.units[at] is None and unit is None:
        unit = model.log_unit or model.unit
    return WatchedColumn(at, _factor_to_model_unit(table, roles, at, model, unit, quantity))


def _factor_to_model_unit(
    table: Table, roles: Roles, at: int, model: NamedModel, unit: str | None, quantity: str
) -> float:
    """Factor that converts the numbers of the column at index `at` to the unit of the model.

    A model without a known unit takes the numbers as they are. Raises `InputError` for a unit of another kind.
    """
    from allanite.common.units import conversion, is_frequency, rate_unit
    from allanite.readers.columns import Request, layout_from_roles

    layout = layout_from_roles(table, roles, Request(columns=(at,), unit=unit, quantity=quantity))
    factor, own = layout.columns[at].scale, rate_unit(layout.units[0], quantity).name
    # The unit 1 also stands for an unknown unit.
    if model.unit is None or (model.unit == "1" and not is_frequency(own)):
        return factor
    return factor * conversion(own, model.unit)


def _column_index(
    table: Table, roles: Roles, column: str | None, model_column: str, source: str
) -> int:
    """Index of the column to watch: the given one, the model's, or the first sensor that may be one.

    In a table without names, a sensor must change. Prints a note if there are several sensors. Raises `InputError` for
    an unknown column and for time stamps. `source` names the source in the note.
    """
    from allanite.readers.columns import Request, layout_from_roles
    from allanite.recording import find_column

    names = table.names
    if column is not None or model_column in names:
        at = find_column(model_column if column is None else column, names)
        if at in roles.time_columns or roles.roles[at] == "time":
            raise InputError(
                f"column {names[at]} holds time stamps: choose a sensor column with --column"
                f" ({', '.join(names)})"
            )
        return at
    samples = layout_from_roles(table, roles, Request()).samples
    sensors = [i for i in samples if _may_be_sensor(table, i)] or [samples[0]]
    if len(sensors) > 1:
        others = ", ".join(names[i] for i in sensors[1:])
        note = f"· {source}: watching column {names[sensors[0]]}; others: {others} (choose with --column NAME)"
        click.echo(plain(note, MAX_MESSAGE_LENGTH), err=True)
    return sensors[0]


def _may_be_sensor(table: Table, at: int) -> bool:
    """True if a column has numbers; in a table without names, the numbers must also change."""
    numbers = table[at][~np.isnan(table[at])]
    return numbers.size > 0 and (table.named or bool(numbers.min() < numbers.max()))


def _table_of_lines(lines: Sequence[str]) -> Table | None:
    """`Table` of the rows of numbers in the first lines; None without any row.

    Names come from the last line above with as many cells, or are x0, x1, …. Rows of another width than the first are
    left out.
    """
    from allanite.readers._table import Table, split_header

    first = next((i for i, line in enumerate(lines) if has_numbers(line)), None)
    if first is None:
        return None
    rows = [cells_of(line) for line in lines[first:] if has_numbers(line)]
    width = len(rows[0])
    numbers = np.array(
        [[_number_of_cell(cell) for cell in row] for row in rows if len(row) == width]
    )
    above = [line.strip().lstrip("#%").strip() for line in lines[:first] if line.strip()]
    # The blank before a unit separates no columns.
    heads = [[line] if width == 1 else cells_of(line) for line in above]
    header = next((cells for cells in reversed(heads) if len(cells) == width and any(cells)), None)
    columns = tuple(numbers.T)
    if header is None:
        names = ("x",) if width == 1 else tuple(f"x{i}" for i in range(width))
        return Table(names, columns, (None,) * width, named=False)
    names, units = split_header(header)
    return Table(names, columns, units)


def _number_of_cell(cell: str) -> float:
    """Float of a cell, also with a decimal comma; NaN if the cell holds no number."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return np.nan

"""Choose the column to watch, and the unit of its numbers, from the first lines of a source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import TYPE_CHECKING

import click
import numpy as np

from allanite.common.errors import MAX_MESSAGE_LENGTH, InputError
from allanite.common.plain import plain
from allanite.common.read_options import ReadOptions
from allanite.common.units import conversion, is_frequency, rate_unit

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import BinaryIO

    from allanite.cli.models import NamedModel
    from allanite.readers import Table
    from allanite.readers.roles import Roles

#: Rows of numbers from which the columns are recognized. Without a header, this many rows show which column is time.
#: Chosen by judgment; not measured.
FIRST_ROWS = 100


def cells_of(line: str, delimiter: str | None = None) -> list[str]:
    """Cells of a row, without blanks at their ends.

    The default `delimiter` is the first of semicolon, tab, ``|`` and comma that the row contains, otherwise any run of
    blanks. The delimiter ``" "`` also means any run of blanks.
    """
    line = line.strip("\r\n ")
    mark = delimiter or next((mark for mark in ";\t|," if mark in line), " ")
    return [cell.strip() for cell in line.split(None if mark == " " else mark)]


def number_of_cell(cell: str) -> float | None:
    """Number in a cell as a float, also with a decimal comma; NaN for an empty cell, None for a text."""
    try:
        return float(cell.replace(",", ".") or "nan")
    except ValueError:
        return None


def has_numbers(line: str) -> bool:
    """True if a line is a row of samples: no comment, and at least half of its non-empty cells are numbers.

    False if all cells are empty.
    """
    cells = [] if line.lstrip().startswith("#") else list(filter(None, cells_of(line)))
    return bool(cells) and 2 * sum(number_of_cell(c) is not None for c in cells) >= len(cells)


@dataclass(frozen=True, slots=True)
class WatchedColumn:
    """The watched column of a source: `index`, `factor` to the unit of the model, `delimiter` as in `cells_of`."""

    index: int
    factor: float = 1.0
    delimiter: str | None = None


def first_lines_of(file: BinaryIO, end: int) -> bytes:
    """First lines of a file before position `end`: the header, and at most 100 rows of numbers; moves the position."""
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
    """Index of the column to watch, the factor to the unit of the model, and the delimiter of the rows.

    The unit of the numbers is that in the header, otherwise the given one, otherwise that of the log to which the model
    was fitted. Without a row of numbers: the first column, factor 1. `column` is the user's choice, and `quantity` is
    ``rate``, ``increment`` or ``angle``. Raises `InputError` if the column is unknown or holds time stamps, or if its
    unit contradicts the given one. Data that are no text log raise it, too.
    """
    from allanite.readers.roles import Roles

    if any("\0" in line for line in lines):
        raise InputError(
            "binary data: the source must be text, with one number or more in each line"
        )
    if not any(map(has_numbers, lines)):
        return WatchedColumn(0)
    table, delimiter = _table_of_lines(lines)
    roles = Roles(table, ReadOptions())
    at = _column_index(roles, column, model.column, source)
    if table.units[at] is None and unit is None:
        unit = model.log_unit or model.unit
    factor = _factor_to_model_unit(roles, at, model, unit, quantity)
    return WatchedColumn(at, factor, delimiter)


def _factor_to_model_unit(
    roles: Roles, at: int, model: NamedModel, unit: str | None, quantity: str
) -> float:
    """Factor by which the numbers in the column with index `at` are multiplied to get the unit of the model.

    If the model has no known unit, the target is the unit that `allanite.read` gives to the samples of this column.
    Raises `InputError` if column and model belong to different kinds of sensor.
    """
    from allanite.readers.columns import layout_from_roles

    layout = layout_from_roles(roles, ReadOptions(column=at, unit=unit, quantity=quantity))
    factor, own = layout.columns[at].scale, rate_unit(layout.units[0], quantity).name
    # The unit 1 also stands for an unknown unit.
    if model.unit is None or (model.unit == "1" and not is_frequency(own)):
        return factor
    return factor * conversion(own, model.unit)


def _column_index(roles: Roles, column: str | None, model_column: str, source: str) -> int:
    """Index of the column to watch: `column` (a name or number) if given, otherwise that of the name `model_column`.

    If no column has that name, it is the first column that `allanite.read` would take for a sensor, and a note lists
    further sensors. In a table without names, columns with constant numbers are skipped if possible. Raises
    `InputError` if `column` does not exist, or if the column holds time stamps.
    """
    from allanite.readers.columns import layout_from_roles
    from allanite.recording import find_column

    table, names = roles.table, roles.table.names
    if column is not None or model_column in names:
        at = find_column(model_column if column is None else column, names)
        if at in roles.time_columns or roles.roles[at] == "time":
            raise InputError(
                f"column {names[at]} holds time stamps: choose a sensor column with --column"
                f" ({', '.join(names)})"
            )
        return at
    samples = layout_from_roles(roles, ReadOptions()).samples
    sensors = [i for i in samples if _may_be_sensor(table, i)] or [samples[0]]
    if len(sensors) > 1:
        others = ", ".join(names[i] for i in sensors[1:])
        note = f"· {source}: watching column {names[sensors[0]]}; others: {others} (choose with --column NAME)"
        click.echo(plain(note, MAX_MESSAGE_LENGTH), err=True)
    return sensors[0]


def _may_be_sensor(table: Table, at: int) -> bool:
    """True if the column with index `at` has numbers other than NaN, which change if the table has no column names."""
    numbers = table[at][~np.isnan(table[at])]
    return numbers.size > 0 and (table.named or bool(numbers.min() < numbers.max()))


def _table_of_lines(lines: Sequence[str]) -> tuple[Table, str]:
    """(`Table` of the columns of numbers in these lines, delimiter), found by the same code that reads text logs.

    Raises `InputError` if the lines are no text log, or if the temporary file for the reader cannot be written.
    """
    from allanite import _kernels
    from allanite.readers.text import core_errors_with_remedy, first_rows_of

    with TemporaryDirectory(prefix="allanite-") as folder:
        path = Path(folder) / "rows.csv"
        try:
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"the first rows cannot be copied to {gettempdir()} ({error.strerror or error})"
            ) from None
        with core_errors_with_remedy(str(path)):
            table, _, delimiter = first_rows_of(path)
            reader = _kernels.TextReader(str(path), delimiter=delimiter)
    return table, reader.meta["delimiter"]

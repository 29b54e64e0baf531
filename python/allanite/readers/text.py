"""Read text logs; delimiter, header, comment lines and decimal comma are recognized automatically."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import AllaniteError, InputError
from allanite.common.memory import require_memory
from allanite.common.plain import plain
from allanite.common.unit_kinds import FOREIGN, kind_of_unit
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table, split_header
from allanite.readers.column_numbers import ROWS
from allanite.readers.deviation_table import refuse_deviation_header
from allanite.recording.samples import default_names


@contextmanager
def core_errors_with_remedy(name: str) -> Iterator[None]:
    """Context that appends a remedy to the message of package errors and removes a leading `name` of the log from them."""
    try:
        yield
    except AllaniteError as error:
        error.found = error.found.removeprefix(f"{name}: ")
        error.found += _row_error_remedy(error.found)
        raise


def _row_error_remedy(found: str) -> str:
    """Remedy to append to the message of an error about a row of a text log; empty for other errors.

    A decimal comma splits each number into two columns. A row then has twice the columns of the header, or one less if the
    first column holds whole numbers.
    """
    match = re.search(r" has (\d+) columns, the header (\d+)$", found)
    if match is not None and int(match[1]) in (2 * int(match[2]), 2 * int(match[2]) - 1):
        return ": for decimal commas, separate the columns by semicolons"
    if re.search(r"^row \d+ has \d+ columns, the others \d+$", found):
        return ": complete or delete the row"
    if re.search(r"^row \d+, column .* is not a number$", found):
        return ": delete the row, or leave the cell empty for a missing sample"
    return ""


#: A line that states the sampling rate: "// Update Rate: 100.0Hz", "fs = 2 kHz".
_RATE = re.compile(
    r"^[#%/!;\"\s]*(?:fs|f_s|odr|(?:update|sample|sampling|output|data|imu)[ _]*(?:data[ _]*)?(?:rate|freq\w*))"
    r"[\"\s]*(?:[\[(]\s*hz\s*[\])])?[\"\s]*[:=,;\t ]{1,2}\s*([0-9]+(?:\.[0-9]*)?)\s*(?:(k)?hz)?[\"\s,;]*$",
    re.IGNORECASE,
)

#: Sampling interval in s as Stable32 states it: "# Tau: 1.0e+00".
_INTERVAL = re.compile(
    r"^[#%/!;\"\s]*tau0?\s*[:=,]\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*(?:s|sec|seconds)?[\"\s,;]*$",
    re.IGNORECASE,
)
#: Beginning of model files of allanite, which are no logs.
_DOCUMENT = re.compile(rb'\s*\{\s*"schema":\s*"(allanite/(?:model|fit|check)/\d+)"')

#: Bytes of memory per cell while a text log is read: a float64, and 20 % more for growing arrays.
MEMORY_PER_CELL = 1.2 * 8.0

#: Cells with a date or a time of day, and dates in which the month may come first.
_DATE = re.compile(r"^\d{1,4}[-/]\d{1,2}[-/]\d{1,4}|^\d\d\.\d\d\.\d{4}|^\d{1,2}:\d\d:\d\d")
_SLASHED = re.compile(r"^\d{1,2}/\d{1,2}/\d{4}")
#: Header → units that the program behind this header defines. Kalibr's bag creator accepts only these units.
UNITS_OF_HEADERS: dict[tuple[str, ...], tuple[str | None, ...]] = {
    ("timestamp", "omega_x", "omega_y", "omega_z", "alpha_x", "alpha_y", "alpha_z"): (
        "ns",
        *("rad/s",) * 3,
        *("m/s^2",) * 3,
    )
}
#: Entries in a line of units that mean "no unit".
_NO_UNIT = ("", "-", "na", "n/a", "none", "no units", "unitless")
#: A cell that holds only a unit in brackets.
_UNIT = re.compile(r"^[\[(]([^\[\]()]*)[\])]$")


def read(path: Path, pick: Picker) -> Table:
    """`Table` with the picked columns of a text log; columns that are not picked may hold any text.

    Raises `InputError` with file, row, column and text if a cell is no number, or a row has another length.
    """
    begin = head_of(path)
    if begin.startswith(b"version https://git-lfs.github.com/spec/"):
        raise InputError("a pointer of Git LFS, not the log: fetch the log itself (git lfs pull)")
    if begin.lstrip().startswith(b"{") and (found := _DOCUMENT.match(begin)):
        raise InputError(
            f"not a log but a model file ({found[1].decode()})",
            missing="model",
            remedy=": give it with {model}, in addition to a log",
        )
    if b"\0" in begin:
        from allanite.readers import FORMATS

        raise InputError(
            f"binary data, not a text log; if its suffix is wrong, rename it (known: {' '.join(FORMATS.suffixes)})"
        )
    with core_errors_with_remedy(str(path)):
        return _read_table(path, pick)


def _read_table(path: Path, pick: Picker) -> Table:
    """`Table` with the picked columns of a text log; the others are None.

    `pick` sees the first rows. Day and month of slashed dates are exchanged if the record is shorter then, which a note
    says. Raises `InputError` for damaged cells and for too little memory.
    """
    first, cells, delimiter = first_rows_of(path)
    wanted = sorted(set(pick(first)))
    require_memory(
        MEMORY_PER_CELL * len(wanted) * _rows_expected(path), f"a log with {len(wanted)} columns"
    )
    _, columns, _ = _kernels.read_text(str(path), delimiter=delimiter, columns=wanted, finite=True)
    found = dict(zip(wanted, columns, strict=True))
    table = replace(first, columns=tuple(found.get(i) for i in range(len(first.names))))
    slashed = (i for i in first.dates & found.keys() if has_slashed_dates(cells[i]))
    return with_day_first(table, cells, (i for i in slashed if day_comes_first([table[i]])))


def first_rows_of(path: Path) -> tuple[Table, list[str], str | None]:
    """Table with the first 20 000 rows of all columns of a text log, one cell of each column, and the delimiter.

    A column with more texts than numbers is None in the table. The cell is the first one that is no number, or else the
    first. The delimiter is None if the core recognizes it. Raises `InputError` if lines that the core
    does not take for a header name an Allan deviation.
    """
    delimiter = None
    reader = _kernels.TextReader(str(path))
    header = reader.header
    if header is not None and len(header) == 1 and "," in header[0]:
        # Rows of decimal commas below a header with commas are whole numbers separated by commas.
        delimiter = ","
        reader = _kernels.TextReader(str(path), delimiter=delimiter)
        header = reader.header
    if header is not None:
        names, units = split_header(header)
        if "" in names:
            names, units = _names_of_two_lines(path, names, units)
        if not any(units):
            units = _units_below(path, names) or UNITS_OF_HEADERS.get(names) or units
    else:
        refuse_deviation_header(_first_lines(path))
        names = default_names(reader.width)
        units = (None,) * reader.width
    columns, words, cells = reader.sample(ROWS)
    # A column is text if most cells are. A few texts among numbers are damage, which the reader reports with the row.
    texts = {i: cells[i] for i, x in enumerate(columns) if 2 * words[i] > x.size}
    dates = frozenset(i for i in range(len(columns)) if i not in texts and _DATE.match(cells[i]))
    table = Table(
        names,
        tuple(None if i in texts else x for i, x in enumerate(columns)),
        units,
        stated_rate(path),
        named=header is not None,
        texts=texts,
        dates=dates,
        source="header",
    )
    return table, cells, delimiter


def all_numbers(first: Table) -> list[int]:
    """List of the indices of all columns that do not hold text, ascending; columns that were not read count, too."""
    return [i for i in range(len(first.names)) if i not in first.texts]


def has_slashed_dates(cell: str) -> bool:
    """True if a cell begins with a date such as 05/03/2026, in which the day or the month may come first."""
    return _SLASHED.match(cell) is not None


def exchange_day_and_month(seconds: Array) -> Array:
    """Array of date-times, s since 1970, shape (n,), with day and month exchanged; unchanged where the day exceeds 12."""
    days = np.floor(seconds / 86_400.0).astype("datetime64[D]")
    months = days.astype("datetime64[M]")
    years = days.astype("datetime64[Y]")
    day = (days - months).astype(np.int64)  # from 0
    month = (months - years).astype(np.int64)
    other = (years.astype("datetime64[M]") + day).astype("datetime64[D]") + month
    other = np.where(day < 12, other, days)
    return seconds + 86_400.0 * (other - days).astype(np.float64)


def day_comes_first(chunks: Iterable[Array]) -> bool:
    """True if slashed dates such as 03/04/2026 state the day first.

    This is so if a record of at least one day becomes shorter when day and month are exchanged. False if a time is
    missing. `chunks` are the date-times in s since 1970, read with the month first.
    """
    ends: list[Array] = []
    for seconds in chunks:
        if not np.isfinite(seconds).all():
            return False
        both = np.stack([seconds, exchange_day_and_month(seconds)])
        ends += [both.min(axis=1), both.max(axis=1)]
    month_first, day_first = np.ptp(ends, axis=0) if ends else (0.0, 0.0)
    return bool(month_first >= 86_400.0 and day_first < month_first)


def with_day_first(table: Table, cells: Sequence[str], columns: Iterable[int]) -> Table:
    """`Table` with day and month exchanged in these columns, and a note about each, with its entry of `cells`."""
    arrays, notes = list(table.columns), list(table.notes)
    for i in sorted(columns):
        arrays[i] = exchange_day_and_month(table[i])
        notes.append(
            f"dates such as {plain(cells[i], 24)} are read with the day first, because the record is shorter then"
        )
    return replace(table, columns=tuple(arrays), notes=tuple(notes))


def _rows_expected(path: Path) -> float:
    """Expected number of rows of a log, from the mean length of the lines in its first 64 kB; 0 for an empty file."""
    with path.open("rb") as stream:
        begin = stream.read(1 << 16)
    return path.stat().st_size * begin.count(b"\n") / len(begin) if begin else 0.0


def _first_lines(path: Path) -> list[str]:
    """List of the first lines of a text file: at most 40, within its first 4096 characters."""
    with path.open(encoding="latin-1") as stream:
        return stream.read(4096).splitlines()[:40]


def stated_rate(path: Path) -> float | None:
    """Sampling rate in Hz that a comment or preamble states (``// Update Rate: 100.0Hz``, ``# Tau: 0.01``), or None."""
    lines = _first_lines(path)
    found = next((match for line in lines if (match := _RATE.match(line))), None)
    if found is not None:
        return float(found[1]) * (1e3 if (found[2] or "").lower() == "k" else 1.0)
    tau = next((float(match[1]) for line in lines if (match := _INTERVAL.match(line))), 0.0)
    return 1.0 / tau if tau > 0 else None


def _names_of_two_lines(
    path: Path, names: tuple[str, ...], units: tuple[str | None, ...]
) -> tuple[tuple[str, ...], tuple[str | None, ...]]:
    """Names and units of a header whose second line has the names of columns below those of groups.

    A column is then named ``group column`` and has the unit of its group. A header of one line is returned unchanged.
    """
    rows = list(_lines_of_cells(path, len(names)))
    above = next((i for i, cells in enumerate(rows) if split_header(cells)[0] == names), None)
    if above is None or above + 1 == len(rows):
        return names, units
    below = rows[above + 1]
    if not all(below[i] for i, name in enumerate(names) if not name) or any(map(_is_number, below)):
        return names, units
    found: list[str] = []
    of: list[str | None] = []
    group = ""
    for name, unit, own in zip(names, units, below, strict=True):
        group = name or group
        of.append(unit if name or not of else of[-1])
        found.append(f"{group} {plain(own)}".strip())
    return tuple(found), tuple(of)


def _is_number(cell: str) -> bool:
    """True if Python can convert the text of a cell to a float (also ``nan``)."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _lines_of_cells(path: Path, count: int) -> Iterator[list[str]]:
    """Yield the stripped cells of the lines with exactly `count` cells; only 60 lines, within 16 kB, are read."""
    with path.open("rb") as stream:
        lines = stream.read(16384).decode("utf-8", "replace").splitlines()[:60]
    for line in lines:
        cells = [cell.strip() for cell in re.split(r"[\t;,]", line)]
        if len(cells) == count:
            yield cells


def _units_below(path: Path, names: tuple[str, ...]) -> tuple[str | None, ...] | None:
    """Units in a line below the names: ``(us) (na) (m/s^2)`` or ``ms deg/s``; None without such a line.

    An entry is None for empty brackets, or for ``-``, ``n/a`` and the like without brackets.
    """
    rows = list(_lines_of_cells(path, len(names)))
    for cells in rows:
        found = [_UNIT.match(cell) for cell in cells]
        if all(found):
            return tuple(plain(m[1]) if m is not None and m[1] else None for m in found)
    # Without brackets, only the line directly below the names counts, and each cell must be a unit or mean "no unit".
    for names_of, cells in pairwise(rows):
        if split_header(names_of)[0] == names and not any(map(_is_number, cells)):
            units = [None if cell.lower() in _NO_UNIT else cell for cell in cells]
            known = [kind_of_unit(u) is not None and kind_of_unit(u) != FOREIGN for u in units if u]
            return tuple(u and plain(u) for u in units) if any(known) and all(known) else None
    return None

"""Table that every reader returns: columns of numbers with names, units and other statements of the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from allanite.common.errors import InputError, TooShortError
from allanite.common.plain import plain
from allanite.common.unit_kinds import time_unit
from allanite.common.units import ACCELERATION
from allanite.readers.unit_names import unit_in_name
from allanite.recording.samples import distinct_names
from allanite.recording.sensor_names import sensor_kind, words_in


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of a log.

    Attributes
    ----------
    names : tuple of str
        Name of each column, without its unit. Repeated names get a number.
    columns : tuple of (ndarray of shape (n,) or None)
        The numbers; None for a column that was not read.
    units : tuple of (str or None)
        Unit of each column, if the file states it in its header or at the end of the name.
    rate : float or None
        Sampling rate that the file states, Hz.
    time : ndarray of shape (n,) or None
        Time stamps that are not one of the columns.
    named : bool
        Whether the names come from the file. Otherwise they are x0, x1, ….
    notes : tuple of str
        Remarks of the reader for the user.
    texts : mapping of int to str
        Mapping from the index of each column of text to one of its cells.
    dates : frozenset of int
        Columns whose date-times were converted to seconds.
    source : str
        Source of names and units: ``"header"``, or ``"file"`` for a format that fixes them.
    others : tuple of str
        Topics of the log with another sensor of the same device at another sampling rate.
    """

    names: tuple[str, ...]
    columns: tuple[NDArray[Any] | None, ...]
    units: tuple[str | None, ...]
    rate: float | None = None
    time: NDArray[Any] | None = None
    named: bool = True
    notes: tuple[str, ...] = ()
    texts: Mapping[int, str] = field(default_factory=dict)
    dates: frozenset[int] = frozenset()
    source: str = "file"
    others: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, columns: Sequence[tuple[str, NDArray[Any], str | None]], **statements: Any
    ) -> Table:
        """`Table` of columns (name, values, unit or None); `statements` are further fields, such as ``rate=100.0``."""
        names, values, units = zip(*columns, strict=True) if columns else ((), (), ())
        return cls(names, values, units, **statements)

    def __post_init__(self) -> None:
        """Make names printable and distinct, and derive each unit from the given unit or from the name."""
        # Names and units in a file may hold any characters.
        names = tuple(_collapse_long_blanks(plain(name)) for name in self.names)
        units = [u and _collapse_long_blanks(plain(u)) for u in self.units]
        units_of_columns = [_unit_of(name, u) for name, u in zip(names, units, strict=True)]
        object.__setattr__(self, "names", distinct_names(names))
        object.__setattr__(self, "units", tuple(units_of_columns))

    def __getitem__(self, at: int) -> NDArray[Any]:
        """Values of the column with this index, shape (n,); raises `IndexError` if the column was not read."""
        column = self.columns[at]
        if column is None:
            raise IndexError(f"column {self.names[at]} was not read")
        return column

    @property
    def n(self) -> int:
        """Number of rows; 0 if no column was read."""
        return next((len(c) for c in self.columns if c is not None), 0)


def _collapse_long_blanks(name: str) -> str:
    """Name or unit as given; if it has more than 1000 characters, with single spaces instead of runs of blanks."""
    return name if len(name) <= MAX_HEADER_LENGTH else " ".join(name.split())


def _unit_of(name: str, unit: str | None) -> str | None:
    """The given `unit` of a column, or else the unit at the end of its name, or None.

    The units mG, milli-g, milliG and mili-g of an accelerometer become ``mg``.
    """
    if unit in _GRAVITY and sensor_kind(name) == ACCELERATION:
        return _GRAVITY[unit]
    return unit or unit_in_name(name)


#: Spellings of milli-g, some of which mean milligauss for a magnetometer.
_GRAVITY = {"mG": "mg", "milli-g": "mg", "milliG": "mg", "mili-g": "mg"}
#: Maximum number of columns of an array with fewer samples than columns. Such an array is probably transposed.
MAX_COLUMNS = 10_000


def check_shape(shape: tuple[int, ...]) -> None:
    """Raise `TooShortError` for an array without samples, `InputError` for over 10 000 columns and fewer rows."""
    rows, columns = shape if len(shape) == 2 else (*shape, 1)
    if rows < 1 or columns < 1:
        raise TooShortError(f"no samples: the shape is {shape}")
    if columns > max(MAX_COLUMNS, rows):
        raise InputError(
            f"an array with {rows} samples in {columns} columns: each row must be one sample, so transpose the array"
        )


def columns_of(data: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Tuple of the columns of an array of shape (n,) or (n, k), without a copy."""
    return (data,) if data.ndim == 1 else tuple(data[:, i] for i in range(data.shape[1]))


# Function of a table with the first rows of all columns that returns the indices of the columns to read.
Picker = Callable[["Table"], Sequence[int]]

#: A name followed by a unit in brackets. The unit may hold one pair of parentheses: deg/(s·h).
_WITH_UNIT = re.compile(
    r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*$"
)
#: Maximum length of a header cell that is searched for a unit, characters. The time of the search grows with its square.
MAX_HEADER_LENGTH = 1000
#: Text in brackets that distinguishes columns and is no unit: an index, a register (x8004), an axis, a state of the data.
_NOT_A_UNIT = re.compile(
    r"\d+|0?x[0-9a-f]+|[xyz]|[ijk]|roll|pitch|yaw|left|right|raw|filtered|calibrated|uncalibrated",
    re.IGNORECASE,
)


def split_unit(cell: str) -> tuple[str, str | None]:
    """Tuple (name, unit or None) from a text such as ``"gyro x [deg/s]"``.

    An index such as ``gyro[0]`` is part of the name. ``[1]`` is a unit unless the name is that of an inertial sensor. A
    text of over 1000 characters has no unit.
    """
    match = _WITH_UNIT.match(cell) if len(cell) <= MAX_HEADER_LENGTH else None
    if match is None or not match["name"]:
        return cell.strip(), None
    unit = match["unit"].strip()
    # [1] is a unit for a clock, but an index for a gyroscope.
    dimensionless = unit == "1" and sensor_kind(match["name"]) is None
    if _NOT_A_UNIT.fullmatch(unit) and not dimensionless:
        name, inner = split_unit(match["name"])
        return cell.strip() if inner is None else f"{name} {unit}", inner
    return match["name"], unit or None


def split_header(cells: Sequence[str]) -> tuple[tuple[str, ...], tuple[str | None, ...]]:
    """Tuple (names, units) of the cells of a header; a unit is None if missing."""
    pairs = [split_unit(cell) for cell in cells]
    # In y[0], y[1], y[2], the 1 is an index like the others.
    indexed = {
        cell[: cell.index("[")].strip()
        for cell in cells
        if re.search(r"\[(0|[2-9]|\d\d+)\]\s*$", cell)
    }
    pairs = [
        (cell.strip(), None) if unit == "1" and name in indexed else (name, unit)
        for cell, (name, unit) in zip(cells, pairs, strict=True)
    ]
    return tuple(plain(name) for name, _ in pairs), tuple(unit and plain(unit) for _, unit in pairs)


#: Words that state a unit of time anywhere in a name, and words that state it only at the end.
_TIME_WORD = re.compile(
    r"(^|_)(milli|micro|nano)?(sec|secs|second|seconds)(_|$)|(^|_)(millis|micros|nanos|msec|usec|nsec)(_|$)"
)
_TIME_WORD_AT_END = re.compile(
    r"(?:^|_)(s|ms|us|µs|ns|min|mins|minutes?|h|hrs?|hours?|d|days?|m?jd|yr|years?)$"
)
#: Names of times in days and in years.
_DAYS = re.compile(r"^(doy|day_?of_?year|julian_(day|date))$")
_YEARS = re.compile(
    r"^((dec(imal)?_?|frac(tional)?_?)?year(_?(dec(imal)?|frac))?|decyear|yyyy\w*)$"
)


def time_unit_of(name: str, unit: str | None) -> str | None:
    """Unit of a time column from its unit, or else from its name, such as ``MJD`` or ``timestamp_us``; None without one."""
    stated = time_unit(unit)
    if stated is not None:
        return stated
    words = words_in(name)
    if words.replace("_", "") == "sampletimefine":  # Xsens: a counter of 10 kHz
        return "100us"
    if _DAYS.match(words):
        return "d"
    if _YEARS.match(words):
        return "y"
    words = re.sub(r"_(of|since|from|after)_(the_)?(day|week|year|midnight|start|boot)", "", words)
    joined = re.search(r"time(?:stamp)?(ns|us|ms)$", words)
    last = joined or _TIME_WORD_AT_END.search(words)
    if last is not None:
        return time_unit(last[1])
    found = _TIME_WORD.search(words)
    return None if found is None else time_unit(found[0].strip("_"))

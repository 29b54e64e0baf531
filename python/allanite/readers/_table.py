"""What every reader returns: columns of numbers with what the file says about them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError, TooShortError
from allanite.common.plain import plain
from allanite.readers.unit_names import unit_in_name
from allanite.recording.samples import distinct
from allanite.recording.timebase import TIME_UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Picker", "Table", "check_shape", "columns_of", "split_unit", "time_unit_of"]


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of a log.

    Attributes
    ----------
    names : tuple of str
        One a column, without units; those that repeat one are told apart by a number.
    columns : tuple of (ndarray of shape (n,) or None)
        The numbers; None where a column was not asked for and not read.
    units : tuple of (str or None)
        Unit of each column as the file says it, if it does: in its header, or at the end of its name.
    rate : float or None
        Sampling rate that the file states, Hz.
    time : ndarray of shape (n,) or None
        Time stamps kept apart from the columns.
    named : bool
        Whether the names come from the file (else they are made up: x0, x1, …).
    notes : tuple of str
        What the reader has to tell.
    """

    names: tuple[str, ...]
    columns: tuple[NDArray[Any] | None, ...]
    units: tuple[str | None, ...]
    rate: float | None = None
    time: NDArray[Any] | None = None
    named: bool = True
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # Names and units are a stranger's text.
        names = tuple(map(plain, self.names))
        units = [u and plain(u) for u in self.units]
        said = [u or unit_in_name(name) for u, name in zip(units, names, strict=True)]
        object.__setattr__(self, "names", distinct(names))
        object.__setattr__(self, "units", tuple(said))

    def __getitem__(self, at: int) -> NDArray[Any]:
        """Return a column that was asked for."""
        column = self.columns[at]
        if column is None:
            raise IndexError(f"column {self.names[at]} was not read")
        return column

    @property
    def n(self) -> int:
        """Number of rows."""
        return next((len(c) for c in self.columns if c is not None), 0)


#: More columns than this, and fewer samples than columns, is an array whose samples run along the rows.
MOST_COLUMNS = 10_000


def check_shape(shape: tuple[int, ...]) -> None:
    """Refuse an array without samples, and one with so many columns that their names alone would fill the memory.

    Parameters
    ----------
    shape : tuple of int
        ``(n,)`` or ``(n, columns)``.

    Raises
    ------
    TooShortError
        No row, or no column.
    InputError
        Thousands of columns, and more of them than samples.
    """
    rows, columns = shape if len(shape) == 2 else (*shape, 1)
    if rows < 1 or columns < 1:
        raise TooShortError(f"no row in it: its shape is {shape}")
    if columns > max(MOST_COLUMNS, rows):
        raise InputError(
            f"an array of {rows} samples in {columns} columns: samples run down the rows, so transpose it"
        )


def columns_of(data: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Split an array of shape (n,) or (n, k) into its columns, without a copy."""
    return (data,) if data.ndim == 1 else tuple(data[:, i] for i in range(data.shape[1]))


# From names and units of all columns to the indices of those that will be used.
Picker = Callable[[Sequence[str], Sequence[str | None]], Sequence[int]]

_WITH_UNIT = re.compile(
    r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*$"
)


def split_unit(cell: str) -> tuple[str, str | None]:
    """``"gyro x [deg/s]"`` → name and unit; a bracket without a unit stays part of the name."""
    match = _WITH_UNIT.match(cell)
    if match is None or not match["name"]:
        return cell.strip(), None
    return match["name"], match["unit"].strip() or None


def time_unit_of(name: str, unit: str | None) -> str | None:
    """Return the unit of a time column, if its header says it: ``time [ms]``, ``timestamp_us``."""
    if unit in TIME_UNITS:
        return unit
    if name.strip().lower() == "sampletimefine":  # Xsens: a counter of 10 kHz
        return "100us"
    match = re.search(
        r"_?(ns|nsec|nanos?|us|usec|micros?|ms|msec|millis?|_s|_sec)$", name.strip().lower()
    )
    if match is None:
        return "us" if unit == "µs" else None
    return {"n": "ns", "u": "us", "mic": "us", "ms": "ms", "mil": "ms", "_": "s"}[
        next(k for k in ("n", "u", "mic", "ms", "mil", "_") if match.group(1).startswith(k))
    ]

"""Tables of objects of pandas, polars, xarray and Arrow."""

from __future__ import annotations

from os import PathLike
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.readers._table import Table, split_unit
from allanite.recording.samples import stamps_of_index
from allanite.recording.sensor_names import role_of


class Frame(Protocol):
    """Object of pandas, polars, xarray or Arrow. Their classes have only the conversion to an array in common."""

    def __array__(self, *args: Any, **options: Any) -> Any:
        """Array of the values."""


#: A log: path of a file, or a data frame.
Log: TypeAlias = str | PathLike[str] | Frame


def is_frame(log: object) -> bool:
    """True if the object comes from pandas, polars, xarray or pyarrow, and is not the path of a file."""
    return type(log).__module__.split(".")[0] in ("pandas", "polars", "xarray", "pyarrow")


def table_of(frame: Any) -> Table:
    """`Table` of a data frame, a series, an xarray object or an Arrow table; raises `InputError` without numbers.

    The time is the index if it holds date-times or floats. Otherwise it is the first column that holds date-times, or
    that has no numbers but the name of a time. Other columns without numbers are ignored. Booleans become 0 and 1.
    """
    time = stamps_of_index(frame)
    columns: list[tuple[str, NDArray[Any], str | None]] = []
    for title, values, stated in _named_columns(frame):
        name, unit = split_unit(title)
        array = np.asarray(values)
        if array.dtype.kind == "b":
            array = array.astype(np.int64)
        if array.dtype.kind in "mM" or _is_dates(array):
            time = array if time is None else time
        elif array.dtype.kind in "iuf" and array.ndim == 1:
            columns.append((name, array, stated or unit))
        elif role_of(name, unit) == "time" and time is None:
            time = _as_text(array) if array.dtype.kind == "O" else array
    if not columns:
        raise InputError(f"no column of numbers in the {type(frame).__name__}")
    return Table.of(columns, time=time)


def _is_dates(array: NDArray[Any]) -> bool:
    """True if an array of objects begins with a date-time, such as a date-time with a time zone."""
    return array.dtype.kind == "O" and array.size > 0 and hasattr(array[0], "timestamp")


def _as_text(array: NDArray[Any]) -> NDArray[Any]:
    """Array of texts, in which None becomes an empty text; the array itself if an object is not a text."""
    values = ["" if value is None else value for value in array.tolist()]
    if not all(isinstance(value, str) for value in values):
        return array
    # In a numpy array, every text takes as much memory as the longest.
    require_memory(4 * len(values) * max(map(len, values), default=0), "a column of text")
    return np.array(values, dtype=np.str_)


def _named_columns(frame: Any) -> list[tuple[str, Any, str | None]]:
    """Tuples (name, values, unit or None) of the columns of a frame, series, xarray object or Arrow table.

    Units come only from the attribute ``units`` of xarray objects and pandas series.
    """
    if hasattr(frame, "data_vars"):  # an xarray data set
        found = [(str(name), var, var.attrs.get("units")) for name, var in frame.data_vars.items()]
        return [
            (f"{name}_{i}" if var.ndim > 1 else name, part, unit)
            for name, var, unit in found
            for i, part in enumerate(np.atleast_2d(np.asarray(var).T))
        ]
    if hasattr(frame, "column_names"):  # Arrow
        return [(name, frame.column(name).to_numpy(), None) for name in frame.column_names]
    if hasattr(frame, "columns"):
        return [(str(name), frame[name], None) for name in frame.columns]
    unit = getattr(frame, "attrs", {}).get("units")
    array = np.atleast_2d(np.asarray(frame).T)
    name = str(getattr(frame, "name", None) or "x")
    return [(f"{name}{i}" if len(array) > 1 else name, part, unit) for i, part in enumerate(array)]

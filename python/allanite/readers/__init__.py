"""Logs in: one format a file, one registry, one `read`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import AllaniteError, InputError
from allanite.readers._choice import Request, choose, unit_of
from allanite.readers._table import time_unit_of
from allanite.readers.frame import is_frame, table_of
from allanite.readers.packed import is_packed, unpacked
from allanite.readers.understand import understand
from allanite.recording import Recording
from allanite.recording.findings import Finding
from allanite.recording.samples import locked

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from allanite.readers._table import Picker, Table

__all__ = ["FORMATS", "read", "read_table"]

# Suffix → module whose `read(path, pick)` returns a Table. Anything else is read as text.
FORMATS = {
    ".npy": "npy",
    ".npz": "npz",
    ".mat": "matlab",
    ".bag": "rosbag",
    ".db3": "rosbag",
    ".mcap": "rosbag",
    ".ulg": "ulog",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".hdf": "hdf5",
    ".nc": "hdf5",
    ".nc4": "hdf5",
    ".cdf": "hdf5",
    ".parquet": "parquet",
    ".feather": "parquet",
    ".arrow": "parquet",
    ".clk": "rinex",
    ".phd": "stable32",
    ".frd": "stable32",
}

#: Those whose logs have topics.
TOPICAL = ("rosbag", "ulog", "ardupilot")


def read(
    path: Any,
    rate: float | None = None,
    unit: str | None = None,
    quantity: str | None = None,
    column: str | int | Sequence[str | int] | None = None,
    covariate: str | Sequence[str] | None = None,
    time_column: str | int | None = None,
    piece: int | None = None,
    topic: str | Sequence[str] | None = None,
) -> Recording:
    """Read a log.

    Parameters
    ----------
    path : str, Path or data frame
        A file: text (any delimiter, header or not, also packed by gzip), or a format of `FORMATS`. Or an
        object of pandas, polars, xarray or Arrow, whose index or column of date-times is the time.
    rate : float, optional
        Sampling rate in Hz; else what the file states, else from the time column.
    unit : str, optional
        Unit of the samples; else what the file states, else ``"1"``.
    quantity : {"rate", "increment", "angle"}, optional
        What the samples are; ``"rate"``, or ``"angle"`` if the file's unit is s.
    column : str, int or sequence of these, optional
        Columns to read, by name or 0-based index; default every sensor column.
    covariate : str or sequence of str, optional
        Columns offered as an explanation, beside those called temperature.
    time_column : str or int, optional
        Column of time stamps; default one called time, t, timestamp, stamp, …; ``"none"`` for none.
    piece : int, optional
        Of a record that jumps of its clock part, the piece to take, from 1; default the longest.
    topic : str or sequence of str, optional
        Topic of a ROS bag, ULog or ArduPilot log; default its first inertial one.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        The file or an option cannot be used; the message names file, row and column.
    """
    request = Request(
        rate,
        unit,
        quantity,
        () if column is None else (column,) if isinstance(column, str | int) else tuple(column),
        (covariate,) if isinstance(covariate, str) else tuple(covariate or ()),
        time_column,
        piece,
        (topic,) if isinstance(topic, str) else tuple(topic or ()),
    )
    if is_frame(path):
        return _recording(None, request, table_of(path))
    path = Path(path)
    try:
        where = str(path)
        pick = lambda names, units: choose(names, units, request, where).all  # noqa: E731
        table = read_table(path, pick, request.topics)
        return _recording(path, request, table)
    except AllaniteError as error:
        text = str(error)
        raise type(error)(text if str(path) in text else f"{path}: {text}") from None


def _recording(path: Path | None, request: Request, table: Table) -> Recording:
    where = str(path or "log")
    choice = choose(
        table.names,
        table.units,
        request,
        where,
        stamped=table.time is not None,
        time_at=0 if not table.named and looks_like_time(table) else None,
    )
    choice, told = understand(table, choice, request)
    told += [Finding("reader", "info", note) for note in table.notes]
    own = [table.units[i] for i in choice.samples]
    quantity = request.quantity
    if quantity is None:
        phases = all(unit == "s" for unit in own) and request.unit is None
        quantity = "angle" if phases else "rate"
    units = [
        unit_of(table.names[i], unit, request.unit, quantity, where)
        for i, unit in zip(choice.samples, own, strict=True)
    ]
    _same_length(table, [*choice.samples, *choice.covariates], where)
    at = choice.time
    recording = Recording(
        _take(table, choice.samples),
        request.rate if request.rate is not None else table.rate,
        time=None if request.timeless else table.time if at is None else table[at],
        unit=units,
        quantity=quantity,
        columns=[table.names[i] for i in choice.samples],
        covariates={table.names[i]: table[i] for i in choice.covariates},
        path=path,
        # One unit for all columns is the samples': it says nothing of a temperature beside them.
        covariate_units={
            table.names[i]: (len(set(table.units)) > 1 and table.units[i]) or "1"
            for i in choice.covariates
        },
        time_unit=None if at is None else time_unit_of(table.names[at], table.units[at]),
        piece=request.piece,
    )
    return recording.told_of(told)


def read_table(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:
    """Read the columns of a log that are picked, by the reader of its format.

    Parameters
    ----------
    path : Path
        The log.
    pick : callable
        From names and units of all columns to the indices of those wanted.
    topics : sequence of str
        Topics of a log that has several.
    """
    if path.is_dir():
        if (path / "metadata.yaml").exists():
            return _reader("rosbag", topics)(path, pick)
        # The layout of the EuRoC data set: mav0/imu0/data.csv.
        inside = [path / part / "data.csv" for part in (".", "imu0", "mav0/imu0")]
        found = next((file for file in inside if file.is_file()), None)
        if found is not None:
            return read_table(found, pick, topics)
        raise InputError(f"{path} is a directory: name the log file in it")
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    if size == 0 and path.is_file():
        raise InputError(f"{path}: the file is empty")
    if path.is_file() and is_packed(path):
        with unpacked(path) as inner:
            return read_table(inner, pick, topics)
    try:
        return _reader(FORMATS.get(path.suffix.lower(), "text"), topics)(path, pick)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _reader(name: str, topics: Sequence[str]) -> Callable[[Path, Picker], Table]:
    reader = importlib.import_module(f"allanite.readers.{name}").read
    if not topics:
        return reader
    if name not in TOPICAL:
        raise InputError("--topic is for ROS bags, ULog and ArduPilot logs: this log has no topics")
    return lambda path, pick: reader(path, pick, topics)


def looks_like_time(table: Table) -> bool:
    """Whether the first of several nameless columns advances in every row, as no sensor does."""
    if len(table.names) < 2 or table.n < 100:
        return False
    steps = np.diff(table[0])
    return bool(np.all(steps > 0) and np.median(np.abs(steps / np.median(steps) - 1)) < 0.5)


def _same_length(table: Table, columns: list[int], where: str) -> None:
    """Refuse a column that ends before the others: two recordings in one file."""
    last = [table[i].dtype.kind == "f" and bool(np.isnan(table[i][-1])) for i in columns]
    if any(last) and not all(last):
        ended = columns[last.index(True)]
        present = np.flatnonzero(~np.isnan(table[ended]))
        rows = int(present[-1]) + 1 if present.size else 0
        raise InputError(
            f"{where}: column {table.names[ended]} ends after {rows} rows, others have {table.n}:"
            " read it by itself (--column) or cut the file"
        )


def _take(table: Table, columns: Sequence[int]) -> NDArray[Any]:
    """Stack the samples of some columns; a single one is used where it is, if it can be."""
    if len(columns) > 1:
        return locked(np.column_stack([table[i] for i in columns]))
    column = table[columns[0]]
    return locked(np.ascontiguousarray(column)) if column.flags.owndata else column

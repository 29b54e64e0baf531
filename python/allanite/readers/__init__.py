"""Logs in: one format a file, one registry, one `read`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.errors import AllaniteError, InputError
from allanite.readers._table import Table, role_of, sensor_kind, time_unit_of
from allanite.recording import Recording, find_column
from allanite.units import parse_unit, rate_unit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

__all__ = ["FORMATS", "read", "read_table"]

# Suffix → module of this package whose `read(path)` returns a Table. Anything else is read as text.
FORMATS = {
    ".npy": "npy",
    ".npz": "npz",
    ".mat": "matlab",
    ".bag": "rosbag",
    ".db3": "rosbag",
    ".mcap": "rosbag",
    ".ulg": "ulog",
}


def read(
    path: str | Path,
    rate: float | None = None,
    unit: str | None = None,
    quantity: str | None = None,
    column: str | int | Sequence[str | int] | None = None,
    covariate: str | Sequence[str] | None = None,
    time_column: str | int | None = None,
) -> Recording:
    """Read a log.

    Parameters
    ----------
    path : str or Path
        Text (any delimiter, header or not), NPY, NPZ, MATLAB, ROS bag or MCAP, ULog.
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
        Column of time stamps; default one called time, t, timestamp, stamp, …

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        The file or an option cannot be used; the message names file, row and column.
    """
    path = Path(path)
    table = read_table(path)
    try:
        return _recording(table, path, rate, unit, quantity, column, covariate, time_column)
    except AllaniteError as error:
        text = str(error)
        raise type(error)(text if str(path) in text else f"{path}: {text}") from None


def _recording(
    table: Table,
    path: Path,
    rate: float | None,
    unit: str | None,
    quantity: str | None,
    column: str | int | Sequence[str | int] | None,
    covariate: str | Sequence[str] | None,
    time_column: str | int | None,
) -> Recording:
    where = str(path)
    roles = [role_of(name, u) for name, u in zip(table.names, table.units, strict=True)]
    time, time_at, time_unit = _time(table, roles, time_column, where)
    chosen = _chosen(table, roles, column, unit, time_at, where)
    offered = [i for i, role in enumerate(roles) if role == "temperature" and i not in chosen]
    for name in [covariate] if isinstance(covariate, str) else covariate or ():
        at = find_column(name, table.names, where)
        if at not in offered and at not in chosen:
            offered.append(at)
    own = [table.units[i] for i in chosen]
    if quantity is None:
        quantity = "angle" if own and all(u == "s" for u in own) and unit is None else "rate"
    units = [
        _unit(table.names[i], u, unit, quantity, where) for i, u in zip(chosen, own, strict=True)
    ]
    _same_length(table, [*chosen, *offered], where)
    return Recording(
        _take(table, chosen),
        rate if rate is not None else table.rate,
        time=time,
        unit=units,
        quantity=quantity,
        columns=[table.names[i] for i in chosen],
        covariates={table.names[i]: table.data[:, i] for i in offered},
        path=path,
        covariate_units={table.names[i]: table.units[i] or "1" for i in offered},
        time_unit=time_unit,
    )


def read_table(path: Path) -> Table:
    """All columns of a log, by the reader of its format."""
    if path.is_dir():
        if (path / "metadata.yaml").exists():
            return _reader("rosbag")(path)
        raise InputError(f"{path} is a directory: name the log file in it")
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    if size == 0 and path.is_file():
        raise InputError(f"{path}: the file is empty")
    try:
        return _reader(FORMATS.get(path.suffix.lower(), "text"))(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _reader(name: str) -> Callable[[Path], Table]:
    reader: Callable[[Path], Table] = importlib.import_module(f"allanite.readers.{name}").read
    return reader


def _time(
    table: Table, roles: list[str], time_column: str | int | None, where: str
) -> tuple[NDArray[Any] | None, int | None, str | None]:
    """Find the time stamps, their column's index (or None) and their unit if the header says it."""
    if time_column is not None:
        if table.time is not None and time_column in ("t", "time"):
            return table.time, None, None
        at = find_column(time_column, table.names, where)
    elif table.time is not None:
        return table.time, None, None
    elif "time" in roles:
        at = roles.index("time")
    elif not table.named and _looks_like_time(table):
        at = 0
    else:
        return None, None, None
    return table.data[:, at], at, time_unit_of(table.names[at], table.units[at])


def _looks_like_time(table: Table) -> bool:
    """Whether the first of several nameless columns advances in every row, as no sensor does."""
    if table.data.shape[1] < 2 or table.data.shape[0] < 100:
        return False
    steps = np.diff(table.data[:, 0])
    return bool(np.all(steps > 0) and np.median(np.abs(steps / np.median(steps) - 1)) < 0.5)


def _chosen(
    table: Table,
    roles: list[str],
    column: str | int | Sequence[str | int] | None,
    unit: str | None,
    time_at: int | None,
    where: str,
) -> list[int]:
    if column is not None:
        wanted = [column] if isinstance(column, str | int) else list(column)
        return list(dict.fromkeys(find_column(name, table.names, where) for name in wanted))
    chosen = [i for i, role in enumerate(roles) if role == "sensor" and i != time_at]
    if unit is not None:
        # Gyroscopes and accelerometers in one file: a unit given for one kind chooses it.
        kind = parse_unit(unit).kind if unit != "1" else None
        kinds = [sensor_kind(table.names[i]) for i in chosen]
        if kind in kinds:
            chosen = [i for i, k in zip(chosen, kinds, strict=True) if k == kind]
    if not chosen:
        raise InputError(
            f"{where}: no sensor column found among {', '.join(table.names)}: name it with --column"
        )
    return chosen


def _unit(name: str, own: str | None, given: str | None, quantity: str, where: str) -> str:
    if given is None:
        if own == "s" and quantity == "rate":
            raise InputError(f"{where}: column {name} is in s: give --quantity angle for a phase")
        return own or "1"
    if own is None:
        return given
    try:
        said = rate_unit(own, quantity)
    except InputError:
        return given
    if said.name != rate_unit(given, quantity).name:
        raise InputError(
            f"{where}: column {name} is in {own} by the file, {given} by --unit: leave --unit"
            " out, or convert with --output-unit"
        )
    return given


def _same_length(table: Table, columns: list[int], where: str) -> None:
    """Refuse a column that ends before the others: two recordings in one file."""
    if table.data.dtype.kind != "f" or len(columns) < 2 or not table.data.size:
        return
    last = np.isnan(table.data[-1, columns])
    if last.any() and not last.all():
        ended = columns[int(np.argmax(last))]
        present = np.flatnonzero(~np.isnan(table.data[:, ended]))
        rows = int(present[-1]) + 1 if present.size else 0
        raise InputError(
            f"{where}: column {table.names[ended]} ends after {rows} rows, others have"
            f" {table.data.shape[0]}: read it by itself (--column) or cut the file"
        )


def _take(table: Table, columns: list[int]) -> NDArray[Any]:
    if len(columns) == 1:
        # The only column of a mapped file is used where it is.
        alone = table.data.shape[1] == 1
        return table.data[:, 0] if alone else table.data[:, columns[0]].copy()
    whole = columns == list(range(table.data.shape[1]))
    return table.data if whole else table.data[:, columns]

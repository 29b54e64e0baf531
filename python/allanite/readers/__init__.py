"""Logs in: one format a file, one registry, one `read`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError, TooShortError, about
from allanite.common.memory import require
from allanite.common.plain import plain
from allanite.readers import npy, npz, parquet, sentences, text
from allanite.readers._choice import Request, choose, unit_of
from allanite.readers._isolated import one_line
from allanite.readers._split_time import is_split, joined
from allanite.readers._table import time_unit_of
from allanite.readers.arrays import hdf5, matlab
from allanite.readers.clocks import rinex, stable32, timelab
from allanite.readers.frame import is_frame, table_of
from allanite.readers.packed import is_packed, member, unpacked
from allanite.readers.sensor_names import kind_of_sensor, sensor_kind
from allanite.readers.topics import ardupilot, rosbag, ulog
from allanite.readers.understand import understand
from allanite.readers.unit_names import not_understood, unitless
from allanite.recording import Recording
from allanite.recording.findings import Finding
from allanite.recording.samples import locked

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from allanite.readers._choice import Choice
    from allanite.readers._table import Picker, Table

__all__ = ["FORMATS", "kind_of_sensor", "read", "read_table", "sensor_kind"]

# Suffix → the reader. Anything else is read as text.
FORMATS: dict[str, Callable[[Path, Picker], Table]] = {
    ".npy": npy.read,
    ".npz": npz.read,
    ".mat": matlab.read,
    ".bag": rosbag.read,
    ".db3": rosbag.read,
    ".mcap": rosbag.read,
    ".ulg": ulog.read,
    ".h5": hdf5.read,
    ".hdf5": hdf5.read,
    ".hdf": hdf5.read,
    ".nc": hdf5.read,
    ".nc4": hdf5.read,
    ".cdf": hdf5.read,
    ".parquet": parquet.read,
    ".feather": parquet.read,
    ".arrow": parquet.read,
    ".clk": rinex.read,
    ".bin": ardupilot.read,
    ".phd": stable32.read,
    ".frd": stable32.read,
    ".tim": timelab.read,
}

#: Those whose logs have topics.
TOPICAL = (rosbag.read, ulog.read, ardupilot.read)


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
    r"""Read a log.

    Parameters
    ----------
    path : str, Path or data frame
        A file: text (any delimiter, header or not, also packed by gzip), or a format of `FORMATS`. Or an
        object of pandas, polars, xarray or Arrow, whose index or column of date-times is the time.
    rate : float, optional
        Sampling rate in Hz; else what the file states, else from the time column.
    unit : str, optional
        Unit of the samples; else what the file states, else ``"1"``. Of gyroscopes and accelerometers in one file that of
        one kind leaves the other out; ``"deg/s,m/s^2"`` takes both.
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

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> with open("gyro.csv", "w", encoding="utf-8") as file:
    ...     _ = file.write("time [s],gx [deg/s],temp\n")
    ...     file.writelines(f"{k / 100},{rng.normal():.6f},25.0\n" for k in range(200))
    >>> al.read("gyro.csv")
    Recording(gx: 200 samples at 100 Hz (2 s) in deg/s; covariates temp)
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
    with about(path):

        def pick(names: Sequence[str], units: Sequence[str | None]) -> list[int]:
            choice = choose(names, units, request)
            # Of columns without names any may be the time.
            nameless = all(name == f"x{i}" for i, name in enumerate(names))
            sought = nameless and choice.time is None and request.rate is None
            return list(range(len(names))) if sought and not request.timeless else choice.all

        table = read_table(path, pick, request.topics)
        return _recording(path, request, table)


def _recording(path: Path | None, request: Request, table: Table) -> Recording:
    choice = choose(
        table.names,
        table.units,
        request,
        stamped=table.time is not None,
        time_at=0 if not table.named and looks_like_time(table) else None,
    )
    choice, told = understand(table, choice, request)
    told += _of_other_kinds(table, choice, request)
    told += [Finding("reader", "info", note) for note in table.notes]
    if not request.columns:
        told += not_understood(table.names, table.units)
    own = [table.units[i] for i in choice.samples]
    quantity = request.quantity
    if quantity is None:
        phases = all(unit == "s" for unit in own) and request.unit is None
        quantity = "angle" if phases else "rate"
    units = [
        unit_of(table.names[i], unit, request, quantity)
        for i, unit in zip(choice.samples, own, strict=True)
    ]
    if request.unit is None and quantity == "rate":
        told += unitless([table.names[i] for i in choice.samples if table.units[i] is None])
    choice, dead = _with_values(table, choice)
    told += dead
    time, time_unit = _time_of(table, choice, request)
    recording = Recording(
        _take(table, choice.samples),
        request.rate if request.rate is not None else table.rate,
        time=time,
        unit=units,
        quantity=quantity,
        columns=[table.names[i] for i in choice.samples],
        covariates={table.names[i]: table[i] for i in choice.covariates},
        path=None if path is None else plain(path),
        # One unit for all columns is the samples': it says nothing of a temperature beside them.
        covariate_units={
            table.names[i]: (len(set(table.units)) > 1 and table.units[i]) or "1"
            for i in choice.covariates
        },
        time_unit=time_unit,
        piece=request.piece,
    )
    return recording.told_of(told)


def _of_other_kinds(table: Table, choice: Choice, request: Request) -> list[Finding]:
    """Tell which sensors a unit of one kind leaves out."""
    if not request.kinds or request.columns:
        return []
    left = [
        name
        for i, name in enumerate(table.names)
        if i not in choice.all
        and (sensor_kind(name) or next(iter(request.kinds))) not in request.kinds
    ]
    if not left:
        return []
    found = (
        f"left out, as {request.unit} is no unit of them: {', '.join(left)};"
        " two units, as deg/s,m/s^2, take both kinds"
    )
    return [Finding("other_kind", "warning", found, values={"count": len(left)})]


def _time_of(table: Table, choice: Choice, request: Request) -> tuple[Any, str | None]:
    """Stamps and their unit; those in two columns as one."""
    at, rest = choice.time, choice.rest
    if at is None:
        return None if request.timeless else table.time, None
    if rest is not None and is_split(table[at], table[rest], table.names[rest]):
        return joined(table[at], table[rest], table.names[rest]), "ns"
    return table[at], time_unit_of(table.names[at], table.units[at])


@one_line()
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
            return _reader(rosbag.read, topics)(path, pick)
        # The layout of the EuRoC data set: mav0/imu0/data.csv.
        inside = [path / part / "data.csv" for part in (".", "imu0", "mav0/imu0")]
        found = next((file for file in inside if file.is_file()), None)
        if found is not None:
            return read_table(found, pick, topics)
        raise InputError("is a directory: name the log file in it")
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise InputError("no such file") from None
    except OSError as error:
        raise InputError(f"{error.strerror or error}") from None
    if not path.is_file():
        raise InputError(
            "is a pipe or a device, not a file: a log is read more than once."
            " Pipe it into the command, with - as the name of the log"
        )
    if size == 0:
        raise InputError("the file is empty")
    if path.suffix.lower() == ".zip":
        with member(path, topics) as inner:
            return read_table(inner, pick)
    if is_packed(path):
        with unpacked(path) as inner:
            return read_table(inner, pick, topics)
    reader = FORMATS.get(path.suffix.lower(), text.read)
    if reader is text.read and sentences.is_sentences(path):
        reader = sentences.read
    table = _reader(reader, topics)(path, pick)
    if table.n == 0 and any(column is not None for column in table.columns):
        raise TooShortError("no row in it")
    return table


def _reader(read: Any, topics: Sequence[str]) -> Callable[[Path, Picker], Table]:
    reader: Callable[[Path, Picker], Table] = read
    if not topics:
        return reader
    if read not in TOPICAL:
        raise InputError(
            "topics are for ROS bags, ULog, ArduPilot logs and archives (.zip): this log has no topics"
        )
    return lambda path, pick: read(path, pick, topics)


def looks_like_time(table: Table) -> bool:
    """Whether the first of several nameless columns advances in every row, as no sensor does."""
    if len(table.names) < 2 or table.n < 100:
        return False
    with np.errstate(invalid="ignore"):  # infinities and NaN are no time
        steps = np.diff(table[0])
    return bool(np.all(steps > 0) and np.median(np.abs(steps / np.median(steps) - 1)) < 0.5)


def _with_values(table: Table, choice: Choice) -> tuple[Choice, list[Finding]]:
    """Refuse a column that ends well before the others: of another rate, and filled up to their length.

    Taken as one of theirs it would have their rate. A tail of a hundredth of the rows is a gap like any other, and
    what ends within the first hundredth never worked: of a sensor its own axis says so, a covariate is left out.
    """
    ends = {i: _end(table[i]) for i in (*choice.samples, *choice.covariates)}
    longest = max(ends.values())
    hundredth = longest // 100
    for i, end in ends.items():
        if hundredth < end < longest - max(hundredth, 1):
            raise InputError(
                f"column {table.names[i]} ends after {end} rows, others have {longest}: of another rate,"
                " or it failed there",
                missing="column",
                remedy="; read it by itself, or the others, with {column}, or cut the file",
            )
    dead = [i for i in choice.covariates if ends[i] <= hundredth]
    told = [
        Finding(
            "no_values",
            "warning",
            f"left out, as it has {np.count_nonzero(~np.isnan(table[i]))} values in {longest} rows: {table.names[i]}",
            values={"rows": longest},
        )
        for i in dead
    ]
    return replace(choice, covariates=tuple(i for i in choice.covariates if i not in dead)), told


def _end(column: NDArray[Any]) -> int:
    """Rows up to the last number that is there."""
    if column.dtype.kind != "f" or not np.isnan(column[-1:]).any():
        return len(column)
    there = np.flatnonzero(~np.isnan(column))
    return int(there[-1]) + 1 if there.size else 0


def _take(table: Table, columns: Sequence[int]) -> NDArray[Any]:
    """Stack the samples of some columns; a single one is used where it is, if it can be."""
    if len(columns) > 1:
        size = sum(table[i].nbytes for i in columns)
        require(size, f"a table of {len(columns)} columns, beside the columns themselves,")
        return locked(np.column_stack([table[i] for i in columns]))
    column = table[columns[0]]
    return locked(np.ascontiguousarray(column)) if column.flags.owndata else column

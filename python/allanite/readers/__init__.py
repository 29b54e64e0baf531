"""Read logs: one module for each format, one table of formats, and one function `read`.

Input: the path of a log, with options such as rate, unit and columns. Output: a `Recording`. Add a format as a module
with a function `read(path, pick)` and a `FORMAT`; modules are found by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError, TooShortError, about
from allanite.common.memory import bytes_text, require_memory
from allanite.common.plain import plain
from allanite.common.read_options import ReadOptions, takes_parameters_of
from allanite.readers import text
from allanite.readers._format import Formats, LogFormat
from allanite.readers._isolated import errors_in_one_line, limits_of, refused_as
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.columns import Layout, layout_of
from allanite.readers.deviation_table import refuse_deviation_table
from allanite.readers.frame import Log, is_frame, table_of
from allanite.readers.packed import is_packed, member, unpacked
from allanite.readers.plausibility import raw_count_findings
from allanite.readers.texts._lines import is_utf16, rewritten, utf16_lines
from allanite.readers.unit_names import no_unit_findings
from allanite.recording import Recording, find_column
from allanite.recording.findings import Finding
from allanite.recording.log_column import LogColumn
from allanite.recording.samples import read_only
from allanite.recording.timebase import Stamps

__all__ = [
    "FORMATS",
    "LogFormat",
    "Picker",
    "Table",
    "limits_of",
    "read",
    "read_sensors",
    "read_table",
    "refused_as",
]

#: All log formats; a file that none of them claims is read as a table of text.
FORMATS = Formats(
    "allanite.readers.arrays",
    "allanite.readers.clocks",
    "allanite.readers.texts",
    "allanite.readers.topics",
)

#: Bytes of memory per byte of a text log with a special format (measured: 6 for JSON lines, 25 for a serial plotter).
MEMORY_PER_BYTE = 30.0
#: Message if a topic is given for a log without topics.
NO_TOPICS = (
    "topics are for ROS bags, ULog, ArduPilot logs, rows of several sensors or clocks, and archives (.zip):"
    " this log has no topics"
)


def read(
    path: Log,
    rate: float | str | None = None,
    unit: str | None = None,
    quantity: str | None = None,
    column: str | int | Sequence[str | int] | None = None,
    covariate: str | Sequence[str] | None = None,
    time_column: str | int | None = None,
    piece: int | None = None,
    topic: str | Sequence[str] | None = None,
    scale: Mapping[str, float] | None = None,
) -> Recording:
    r"""Recording read from a log.

    Parameters
    ----------
    path : str, Path or data frame
        A text file (any delimiter, with or without a header, also compressed by gzip), a file in another format, or an
        object of pandas, polars, xarray or Arrow. The index or date-time column of such an object is the time.
    rate : float or str, optional
        Sampling rate in Hz. Default: the rate in the file, or the rate of the time column. ``"100!"`` uses 100 Hz even
        if the file contradicts.
    unit : str, optional
        Unit of the samples. Default: the unit in the file, or ``"1"``. A unit of one kind of sensor excludes the other
        kind; ``"deg/s,m/s^2"`` reads gyroscopes and accelerometers.
    quantity : {"rate", "increment", "angle"}, optional
        Meaning of the samples. Default: ``"rate"``, or ``"angle"`` if the file's unit is s.
    column : str, int or sequence of these, optional
        Columns to read, by name or 0-based index. Default: every sensor column.
    covariate : str or sequence of str, optional
        Logged columns that the sensor may depend on, in addition to temperatures.
    time_column : str or int, optional
        Column of time stamps. Default: a column named time, t, timestamp, stamp, …. ``"none"`` ignores all of them.
    piece : int, optional
        Segment to read if time jumps split the log, counted from 1. Default: the longest.
    topic : str or sequence of str, optional
        Topic of a ROS bag, ULog or ArduPilot log. Default: its first inertial topic. In a log of several clocks
        (chrony, ntpd, linuxptp), the name of one. Default: the one with most rows.
    scale : mapping of str to float, optional
        Factors on columns, by name. ``{"gx": 1 / 131}`` converts counts of a sensor with 131 LSB/(deg/s) to deg/s.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        The file or an option cannot be used. The message names file, row and column.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> with open("gyro.csv", "w", encoding="utf-8") as file:
    ...     _ = file.write("time [s],gx [deg/s],temp\n")
    ...     file.writelines(f"{k / 100},{rng.normal():.6f},25.0\n" for k in range(200))
    >>> al.read("gyro.csv")
    Recording(gx: 200 samples at 100 Hz (2 s) in deg/s; logged columns temp)
    """
    options = ReadOptions(rate, unit, quantity, column, covariate, time_column, piece, topic, scale)
    recording, others = _read_recording(path, options)
    all_findings = [
        Finding(
            "other_rate",
            "warning",
            f"topic {topic} holds another sensor of this device with a different sampling rate",
            remedy=": characterize reads both topics, {topic} reads one",
        )
        for topic in others
    ]
    return recording.with_findings(all_findings)


@takes_parameters_of(read)
def read_sensors(path: Log, **options: Any) -> list[Recording]:
    """Recordings of a log: the one that `read` returns, then that of the other sensor of the device, if any.

    Some devices log gyroscope and accelerometer as two topics with different rates. Only these topics give a second
    recording, and none if `options`, which are those of `read`, name a topic.
    """
    given = ReadOptions(**options)
    recording, others = _read_recording(path, given)
    other_recordings = (_read_recording(path, replace(given, topic=topic))[0] for topic in others)
    return [recording, *other_recordings]


def _read_recording(path: Any, options: ReadOptions) -> tuple[Recording, tuple[str, ...]]:
    """Tuple (recording, topics): topics, often none, of the same device at another sampling rate; they are not read."""
    if is_frame(path):
        table = table_of(path)
        return _recording_of_table(None, options, table, layout_of(table, options)), ()
    path = Path(path)
    with about(path):
        decided: list[Layout] = []

        def pick(first_rows: Table) -> Sequence[int]:
            """Indices of the columns to read, decided from the first rows; appends the layout to `decided`."""
            refuse_deviation_table(first_rows)
            decided.append(layout_of(first_rows, options))
            return decided[0].used

        table = read_table(path, pick, options.topics)
        layout = decided[0] if decided else layout_of(table, options)
        return _recording_of_table(path, options, table, layout), table.others


def _recording_of_table(
    path: Path | None, options: ReadOptions, table: Table, layout: Layout
) -> Recording:
    """`Recording` of the columns that the layout selects, with all findings about the log and its columns.

    Raises `InputError` if the requested rate contradicts the file or the stamps.
    """
    refuse_contradicting_rate(options, table.rate, None)
    covariates, dead = _covariates_with_values(table, layout)
    time, time_unit = _time_and_unit(table, layout, options)
    recording = Recording(
        _scaled_samples(table, layout),
        options.rate_hz if options.rate_hz is not None else table.rate,
        time=time,
        unit=list(layout.units),
        quantity=layout.quantity,
        columns=[table.names[i] for i in layout.samples],
        covariates={table.names[i]: table[i] for i in covariates},
        path=None if path is None else plain(path),
        # If all columns have one unit, it is the unit of the samples, not of a temperature.
        covariate_units={
            table.names[i]: (len(set(table.units)) > 1 and table.units[i]) or "1"
            for i in covariates
        },
        time_unit=time_unit,
        piece=options.piece,
    )
    refuse_contradicting_rate(options, None, recording.stamps)
    scaled = {table.names[find_column(name, table.names)] for name in options.scales}
    all_findings = [
        *findings_of_layout(options, table, layout),
        *dead,
        *raw_count_findings(recording, scaled),
    ]
    return recording.with_findings(
        all_findings, _columns_with_rates(recording, options, table, layout)
    )


def findings_of_layout(options: ReadOptions, table: Table, layout: Layout) -> list[Finding]:
    """List of the findings about the columns of a table, the remarks of its reader, and samples without a unit."""
    found = [*layout.findings, *(Finding("reader", "info", note) for note in table.notes)]
    if options.unit is None and layout.quantity == "rate":
        found += no_unit_findings(
            [table.names[i] for i in layout.samples if table.units[i] is None]
        )
    return found


#: Maximum relative difference of two rates that counts as equal. It changes the level of white noise by 0.05 %, and the
#: crystals of loggers differ by less.
MAX_RATE_DIFFERENCE = 1e-3


def refuse_contradicting_rate(
    options: ReadOptions, stated: float | None, stamps: Stamps | None
) -> None:
    """Raise `InputError` if the requested rate differs from that of the time stamps, or else from the `stated` one (Hz).

    Stamps whose unit is a guess are ignored. The limit is 0.1 %. For stamps it is at least three standard errors of
    their rate: the jitter of one interval over the length of the record. If several rows share a stamp, the resolution
    of the stamps is added to the jitter.
    """
    rate = options.rate_hz
    if rate is None or options.overrides_rate or not 0.0 < rate < np.inf:
        return
    if stamps is not None and not stamps.guessed:
        error = stamps.jitter + (stamps.resolution if stamps.coarse else 0.0)
        uncertain = 3 * error * stamps.rate / stamps.n
        found, source, limit = stamps.rate, "the time column", max(MAX_RATE_DIFFERENCE, uncertain)
    elif stated is not None:
        found, source, limit = stated, "the file", MAX_RATE_DIFFERENCE
    else:
        return
    if abs(found / rate - 1) > limit:
        raise InputError(
            f"{source} says {found:.6g} Hz, not {rate:g} Hz",
            missing="rate",
            remedy=f": leave the rate out, or insist with {{this_rate:{rate:g}}}",
        )


def _columns_with_rates(
    recording: Recording, options: ReadOptions, table: Table, layout: Layout
) -> list[LogColumn]:
    """All columns of the layout in its order; used columns get the sampling rate in Hz and its source."""
    stamps = recording.stamps
    if options.rate_hz is not None:
        source = "option"
    elif table.rate is not None:
        source = "file"
    else:
        guessed = stamps is None or stamps.unit_source in ("size", "usual", "epoch")
        source = "guess" if guessed else "header" if layout.roles.time is not None else "file"
    return [
        replace(column, rate=recording.rate, sources={**column.sources, "rate": source})
        if column.used
        else column
        for column in layout.columns
    ]


def _time_and_unit(table: Table, layout: Layout, options: ReadOptions) -> tuple[Any, str | None]:
    """Tuple (time stamps or None, their unit or None if it is not stated).

    A time in several columns is joined to one array in seconds. Without a time column, the stamps are those of the
    file; None if time is ignored.
    """
    time, parts = layout.roles.time, layout.roles.parts
    if parts is not None:
        return parts.joined([table[i] for i in parts.columns]), "s"
    if time is None:
        return None if options.ignores_time else table.time, None
    return table[time], layout.time_unit


@errors_in_one_line()
def read_table(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:
    """Table with the picked columns of a log of any format; compressed logs are unpacked first.

    A folder is read by the format that finds its log there (`LogFormat.log_in`). `pick` gets a table with the first rows
    of all columns; readers that read all columns anyway do not call it. Raises `InputError` for a missing, empty or
    damaged file, for a folder without a known log, and for `topics` of a format without topics. Raises `TooShortError`
    for a log without rows.
    """
    if path.is_dir():
        found = FORMATS.of_folder(path)
        if found is None:
            raise InputError("a directory without a known log: give the path of a log file")
        own, log = found
        return _table_by(own, path, pick, topics) if log == path else read_table(log, pick, topics)
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise InputError("no such file") from None
    except OSError as error:
        raise InputError(f"{error.strerror or error}") from None
    if not path.is_file():
        raise InputError(
            "a pipe or a device, but a log is read more than once: give a file, or pipe the log into the command with"
            " - as its name"
        )
    if size == 0:
        raise InputError("the file is empty")
    if path.suffix.lower() == ".zip":
        with member(path, topics) as inner:
            return read_table(inner, pick)
    if is_packed(path):
        with unpacked(path) as inner:
            return read_table(inner, pick, topics)
    log_format = FORMATS.of_suffix(path.suffix.lower())
    if log_format is None and is_utf16(path):
        require_memory(MEMORY_PER_BYTE * size, f"a log of {bytes_text(size)}")
        with rewritten(path, utf16_lines(path)) as inner:
            return read_table(inner, pick, topics)
    if log_format is None and (log_format := FORMATS.of_head(head_of(path))) is not None:
        require_memory(MEMORY_PER_BYTE * size, f"a log of {bytes_text(size)}")
    return _table_by(log_format, path, pick, topics)


def _table_by(
    log_format: LogFormat | None, path: Path, pick: Picker, topics: Sequence[str]
) -> Table:
    """`Table` of a log in this format, or as delimited text without one; for `pick` and errors see `read_table`."""
    if not topics:
        table = (text.read if log_format is None else log_format.read)(path, pick)
    elif log_format is not None and log_format.has_topics:
        table = log_format.read(path, pick, topics)
    else:
        raise InputError(NO_TOPICS)
    if table.n == 0 and any(column is not None for column in table.columns):
        raise TooShortError("the log has no rows")
    return table


def _covariates_with_values(table: Table, layout: Layout) -> tuple[list[int], list[Finding]]:
    """Tuple (indices of the covariates with values, one warning for each covariate without values).

    A covariate whose last value is in the first 1 % of the rows counts as one without values. Every other used column
    must last to within 1 % of the longest one; else `InputError` is raised.
    """
    ends = {
        i: _length_without_trailing_nan(table[i]) for i in (*layout.samples, *layout.covariates)
    }
    longest = max(ends.values())
    hundredth = longest // 100
    for i, end in ends.items():
        if hundredth < end < longest - max(hundredth, 1):
            raise InputError(
                f"column {table.names[i]} ends after {end} rows, others have {longest}: it has another rate, or the"
                " sensor failed there",
                missing="column",
                remedy="; select it alone, or only the others, with {column}, or cut the file",
            )
    dead = [i for i in layout.covariates if ends[i] <= hundredth]
    all_findings = [
        Finding(
            "no_values",
            "warning",
            f"column {table.names[i]} is not used: only {np.count_nonzero(~np.isnan(table[i]))} values in {longest} rows",
            values={"rows": longest},
        )
        for i in dead
    ]
    return [i for i in layout.covariates if i not in dead], all_findings


def _length_without_trailing_nan(column: NDArray[Any]) -> int:
    """Number of rows up to the last value of a column that is not NaN; 0 if all values are NaN."""
    if column.dtype.kind != "f" or not np.isnan(column[-1:]).any():
        return len(column)
    there = np.flatnonzero(~np.isnan(column))
    return int(there[-1]) + 1 if there.size else 0


def _scaled_samples(table: Table, layout: Layout) -> NDArray[Any]:
    """Sample columns times their scales: array of shape (n,), or (n, columns) for several columns.

    The array is read-only, except for a single column that is a view of another array.
    """
    factors = [layout.columns[i].scale for i in layout.samples]
    taken = [
        table[i] if factor == 1.0 else table[i] * factor
        for i, factor in zip(layout.samples, factors, strict=True)
    ]
    if len(taken) > 1:
        size = sum(column.nbytes for column in taken)
        require_memory(size, f"a copy of {len(taken)} columns as one table")
        return read_only(np.column_stack(taken))
    return read_only(np.ascontiguousarray(taken[0])) if taken[0].flags.owndata else taken[0]

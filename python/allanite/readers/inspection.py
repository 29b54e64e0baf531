"""Inspect a log: how each column is read, with doubts, before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.documents import fields_dict
from allanite.common.errors import CALL, AllaniteError, InputError, about, remedy_text
from allanite.common.numbers import YEAR, number
from allanite.common.plain import plain
from allanite.common.read_options import ReadOptions, takes_parameters_of
from allanite.common.showing import aligned_lines
from allanite.readers import read, read_table
from allanite.readers._table import Table, time_unit_of
from allanite.readers.columns import USE_REMEDY, layout_from_roles
from allanite.readers.deviation_table import refuse_deviation_table
from allanite.readers.frame import Log, is_frame, table_of
from allanite.readers.plausibility import assumed_units, unit_doubts
from allanite.readers.roles import Roles
from allanite.readers.text import all_numbers
from allanite.readers.unit_names import unit_remedy
from allanite.recording import Recording
from allanite.recording.at_rest import motion_findings
from allanite.recording.findings import Finding
from allanite.recording.log_column import LogColumn
from allanite.recording.timebase import read_stamps

#: Number of first rows whose values are shown.
SHOWN_ROWS = 3
#: Unit of dates as numbers.
EPOCH_UNIT = "ns since 1970"
NS_PER_YEAR = 1e9 * YEAR
#: Minimum fraction of a record in motion that is reported, so that the motion is not modeled as noise. Chosen by judgment;
#: not measured.
MIN_MOTION_FRACTION = 0.02
#: Kinds of findings about single columns that are shown. Other findings only matter for computations.
COLUMN_FINDINGS = ("marker", "locked", "not_static")
#: Doubts about a column, as they are stored in `Column.doubts`.
NO_UNIT_DOUBT = "the log does not state its unit: give the unit"
COUNTS_DOUBT = "whole numbers, probably raw counts: give the scale from the data sheet"


@dataclass(frozen=True, slots=True)
class Column(LogColumn):
    """One column of a log, with its first values and problems. `rate` of a time column is that of its stamps, Hz.

    Attributes
    ----------
    first : tuple of float
        First values.
    low, high : float
        Minimum and maximum; NaN for text.
    doubts : tuple of str
        Problems to check before the column is used.
    guessed_unit : str
        Unit of time stamps that was guessed from their size; empty if it is stated.
    """

    first: tuple[float, ...] = ()
    low: float = np.nan
    high: float = np.nan
    doubts: tuple[str, ...] = ()
    guessed_unit: str = ""


@dataclass(frozen=True, slots=True)
class Inspection:
    """How a log is read.

    Attributes
    ----------
    path : str
        Path of the log.
    n : int
        Number of rows.
    rate, duration : float or None
        Sampling rate in Hz and length in s; None if the rate is unknown and must be given.
    problem : str or None
        Reason why the log cannot be read without further options, with the remedy; None if it can be read.
    columns : tuple of Column
        Every column.
    findings : tuple of Finding
        Findings about time stamps, guesses and motion.
    """

    path: str
    n: int
    rate: float | None
    duration: float | None
    problem: str | None
    columns: tuple[Column, ...]
    findings: tuple[Finding, ...] = field(default=())
    refused: AllaniteError | None = field(default=None, repr=False, compare=False)
    """Error behind `problem`, from which the command line and the page make their own wording."""

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the schema ``allanite/inspect/1``."""
        from allanite._kernels import version

        head = {"schema": "allanite/inspect/1", "version": version()}
        return head | fields_dict(self, rate="rate_hz", duration="duration_s", refused="")

    def __str__(self) -> str:
        return self.worded()

    def worded(self, words: Mapping[str, str] = CALL) -> str:
        """Text with path, rows and rate; a table of the columns; doubts, findings and the problem.

        Remedies name parameters by `words`. A line with ``!`` is a warning, one with ``·`` information.
        """
        rate = "rate unknown" if self.rate is None else f"{self.rate:.6g} Hz, {self.duration:.6g} s"
        lines = [f"{self.path} · {self.n} rows · {rate}"]
        head = ("column", "role", "unit", "from", "first values", "range")
        rows = [
            (
                ("" if c.used else "–") + (c.name or "(no name)"),
                ("logged column" if c.used and c.role == "other" else c.role)
                + (f" {c.rate:.5g} Hz" if c.rate and c.role == "time" else ""),
                (c.unit or "?" * (c.role == "sensor"))
                + (f" × {number(c.scale)}" if c.scale != 1.0 else "")
                + (f"{c.guessed_unit} (guess)" if c.guessed_unit else ""),
                c.source,
                *_texts_of_values(c),
            )
            for c in self.columns
        ]
        lines += aligned_lines([head, *rows])
        if any(not c.used for c in self.columns):
            # The finding about columns that are not used names the same remedy.
            told = any(f.kind == "not_used" for f in self.findings)
            lines.append("– not used" + ("" if told else remedy_text(USE_REMEDY, words)))
        open_ = [c.name for c in self.columns if NO_UNIT_DOUBT in c.doubts]
        if open_:
            give = remedy_text(f": {unit_remedy(open_)}; or write the unit into the header", words)
            lines.append(f"! no unit in the log for {', '.join(open_)}{give} (gx [deg/s])")
        whole = [c.name for c in self.columns if COUNTS_DOUBT in c.doubts]
        if whole:
            lines.append(
                f"! {', '.join(whole)}: {COUNTS_DOUBT}{remedy_text(' ({scale}, gx=1/131)', words)}"
            )
        lines += [
            f"! {c.name}: {doubt}"
            for c in self.columns
            for doubt in c.doubts
            if doubt not in (NO_UNIT_DOUBT, COUNTS_DOUBT)
            and not (self.problem or "").endswith(doubt)
        ]
        lines += [
            f"{'!' if f.severity == 'warning' else '·'} {f.worded(words)}" for f in self.findings
        ]
        if self.problem:
            lines.append(
                f"! {self.problem if self.refused is None else self.refused.worded(words)}"
            )
        return "\n".join(lines)


def _texts_of_values(column: Column) -> tuple[str, str]:
    """Texts of the first values and of the range of a column; the range is empty without a finite value."""
    if column.role != "time" or not column.first:
        ends = (
            ""
            if column.low != column.low
            else f"{number(column.low, 4)} … {number(column.high, 4)}"
        )
        return " ".join(number(v, 6) for v in column.first), ends
    if column.unit == EPOCH_UNIT:
        stamps = (
            np.array([*column.first, column.low, column.high]).astype("M8[ns]").astype("M8[ms]")
        )
        texts = [str(stamp).replace("T", " ").removesuffix(".000") for stamp in stamps]
    else:
        steps = np.abs(np.diff(column.first))
        least = float(steps[steps > 0.0].min()) if steps.any() else 1.0
        digits = max(0, 1 - int(np.floor(np.log10(least))))
        texts = [f"{v:.{digits}f}" for v in (*column.first, column.low, column.high)]
        texts = [t.rstrip("0").removesuffix(".") if "." in t else t for t in texts]
    return ", ".join(texts[:-2]) if column.unit == EPOCH_UNIT else " ".join(texts[:-2]), " … ".join(
        texts[-2:]
    )


@takes_parameters_of(read)
def inspect(path: Log, **options: Any) -> Inspection:
    r"""`Inspection` of a log: role, unit, rate and first values of every column, and problems.

    Parameters
    ----------
    path : str, Path or data frame
        Log, as in `allanite.read`.
    **options
        Options of `allanite.read`.

    Returns
    -------
    Inspection
        Prints as a table. `problem` states why the log cannot be read yet, or is None.

    Raises
    ------
    InputError
        The file cannot be opened as a log at all, or is a table of deviations.

    Examples
    --------
    >>> with open("gyro.csv", "w", encoding="utf-8") as file:
    ...     file.writelines(["time [s],gx\n", *(f"{k / 100},{k % 7}\n" for k in range(200))])
    >>> seen = al.inspect("gyro.csv")
    >>> [(c.name, c.role, c.unit) for c in seen.columns]
    [('time', 'time', 's'), ('gx', 'sensor', None)]
    """
    given = ReadOptions(**options)
    table, known, damaged = _table_of_numbers(path, given)
    with about(None if is_frame(path) else path):
        _ = given.unit_by_kind  # raises an error if the given unit is not valid
        refuse_deviation_table(table)
    # A log that is refused may still state its rate.
    stated = table.rate if given.rate_hz is None else given.rate_hz
    rate = stated if stated is not None and 0.0 < stated < np.inf else None
    refused, duration = None, None if rate is None else table.n / rate
    findings: tuple[Finding, ...] = ()
    try:
        recording = read(path, **options)
        rate, duration = recording.rate, recording.duration
        known = recording.log_columns
        moves = _motion_findings_of(recording)
        # Motion is reported once, and a missing unit next to its column.
        shown_kinds = ("no_unit", "motion", *(("not_static",) if moves else ()))
        findings = (
            *moves,
            *unit_doubts(recording.measured),
            *(
                f
                for f in recording.audit
                if f.kind not in shown_kinds and (f.column is None or f.kind in COLUMN_FINDINGS)
            ),
        )
    except AllaniteError as error:
        refused = error
    joined = sum(column.used and column.role == "time" for column in known) > 1
    views = [_describe_column(table, i, column, joined=joined) for i, column in enumerate(known)]
    for i, doubt in damaged.items():
        views[i] = replace(views[i], doubts=(*views[i].doubts, doubt))
    if table.time is not None:
        views.insert(0, _describe_stamps(table.time))
    shown = type(path).__name__ if is_frame(path) else plain(path)
    problem = None if refused is None else str(refused)
    return Inspection(shown, table.n, rate, duration, problem, tuple(views), findings, refused)


def _motion_findings_of(recording: Recording) -> list[Finding]:
    """Findings about motion in at least 2 % of the record; sensors without a unit are tested in deg/s or m/s²."""
    assumed = assumed_units(recording)
    found = motion_findings(recording.in_units(assumed), MIN_MOTION_FRACTION)
    if not assumed:
        return found
    units = ",".join(dict.fromkeys(assumed.values()))
    return [replace(one, found=f"if the unit is {units}: {one.found}") for one in found]


def _table_of_numbers(
    path: Any, options: ReadOptions
) -> tuple[Table, tuple[LogColumn, ...], dict[int, str]]:
    """Tuple (table of the numeric columns, all columns as `LogColumn`, error message by index of a damaged column).

    If the log cannot be read as a whole, each column is read alone and the table omits the damaged ones. Raises
    `InputError` if all columns are damaged, or if the log is damaged but no single column is.
    """
    decided: list[tuple[LogColumn, ...]] = []
    places: list[int] = []

    def everything(first_rows: Table) -> list[int]:
        """Indices of all numeric columns, also stored in `places`; appends the columns to `decided`."""
        decided.append(_columns_of(first_rows, options))
        places[:] = all_numbers(first_rows)
        return places

    if is_frame(path):
        table = table_of(path)
        return table, _columns_of(table, options), {}
    path = Path(path)
    damaged: dict[int, str] = {}
    with about(path):
        try:
            table = read_table(path, everything, options.topics)
        except InputError:
            for at in tuple(places):
                try:
                    read_table(path, lambda *_, at=at: [at], options.topics)
                except InputError as error:
                    damaged[at] = error.found
            if not 0 < len(damaged) < len(places):
                raise
            sound = [at for at in places if at not in damaged]
            table = read_table(path, lambda _: sound, options.topics)
    return table, decided[0] if decided else _columns_of(table, options), damaged


def _columns_of(table: Table, options: ReadOptions) -> tuple[LogColumn, ...]:
    """Tuple of the columns of a table as `LogColumn`; none is used if the log cannot be read, for example has no sensor."""
    found = Roles(table, options)
    try:
        return layout_from_roles(found, options).columns
    except InputError:
        own = {"name": table.source}
        return tuple(
            LogColumn(
                name,
                role,
                False,
                unit,
                reason=reason,
                sources=own | {"role": source} | ({"unit": table.source} if unit else {}),
            )
            for name, unit, role, reason, source in zip(
                table.names, table.units, found.roles, found.reasons, found.sources, strict=True
            )
        )


def _describe_column(table: Table, at: int, known: LogColumn, *, joined: bool) -> Column:
    """`Column` with range, first three values and doubts; `joined` is true for a time in several columns.

    The range is NaN without finite values. A used `joined` time column has no own rate.
    """
    doubts: list[str] = []
    found: dict[str, Any] = {f.name: getattr(known, f.name) for f in fields(known)}
    x = table.columns[at]
    if at in table.texts:
        doubts.append(f'it holds text, such as "{plain(table.texts[at], 24)}"')
    if known.role == "sensor" and known.unit is None and (known.used or not known.reason):
        doubts.append(NO_UNIT_DOUBT)
    if x is not None:
        finite = x[np.isfinite(x)] if x.dtype.kind == "f" else x
        if finite.size:
            low, high = float(finite.min()), float(finite.max())
            found |= {"low": low, "high": high}
            whole = bool((finite == np.round(finite)).all())
            if NO_UNIT_DOUBT in doubts and known.scale == 1.0 and high > low and whole:
                doubts.append(COUNTS_DOUBT)
            if known.role == "sensor" and low == high:
                doubts.append("it never changes")
        if finite.size < x.size:
            missing = x.size - finite.size
            doubts.append("1 value is missing" if missing == 1 else f"{missing} values are missing")
        if known.role == "time" and not (joined and known.used):
            try:
                stamps = read_stamps(x, time_unit_of(known.name, known.unit))
                found["rate"] = stamps.rate
                found["guessed_unit"] = "" if stamps.unit_source == "given" else stamps.unit
            except InputError as error:
                doubts.append(str(error))
        found["first"] = tuple(float(v) for v in x[:SHOWN_ROWS])
    return Column(**found, doubts=tuple(doubts))


def _describe_stamps(time: NDArray[Any]) -> Column:
    """`Column` named ``(time)`` for time stamps that are not a column of the table.

    Date-times are in ns since 1970. Durations, and date-times within the first year, are in s. Plain numbers have no
    unit. Texts have no first values and the range NaN. Unusable stamps have a doubt instead of a rate.
    """
    rate: float | None = None
    doubts: tuple[str, ...] = ()
    try:
        rate = read_stamps(time).rate
    except InputError as error:
        doubts = (str(error),)
    unit, numbers = None, np.asarray(time)
    if time.dtype.kind in "mM":
        numbers = time.astype(f"{time.dtype.kind}8[ns]").astype(np.int64)
        unit = EPOCH_UNIT
        if time.dtype.kind == "m" or numbers.max(initial=0) < NS_PER_YEAR:
            # A time of day, or a time since a start.
            unit, numbers = "s", numbers / 1e9
    real = numbers.dtype.kind in "iuf"
    first = tuple(float(v) for v in numbers[:SHOWN_ROWS]) if real else ()
    low, high = (float(numbers.min()), float(numbers.max())) if real else (np.nan, np.nan)
    sources = {"name": "file", "role": "file"}
    return Column("(time)", "time", True, unit, 1.0, rate, "", sources, first, low, high, doubts)

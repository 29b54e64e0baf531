"""What is understood of a log before anything is computed, column by column."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import CALL, AllaniteError, InputError, about, worded
from allanite.common.plain import plain
from allanite.common.units import FREQUENCY, parse_unit
from allanite.readers._choice import Request, choose
from allanite.readers.frame import is_frame, table_of
from allanite.readers.sensor_names import role_of
from allanite.readers.understand import falls, kind_of, understand
from allanite.readers.unit_names import remedy_of, usual_units
from allanite.recording import Recording
from allanite.recording.at_rest import finding_of
from allanite.recording.timebase import read_stamps

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from allanite.readers._table import Table
    from allanite.recording.findings import Finding

__all__ = ["Column", "Inspection", "inspect"]

#: Rows of which the values are shown.
SHOWN = 3
#: Share of a record in motion from which it is worth a look, before what carried the sensor is modelled.
LEAST = 0.02
UNITLESS = "its unit is not in the log: give it"
COUNTS = "whole numbers, as raw counts are: multiply them by the scale of the data sheet"


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a log.

    Attributes
    ----------
    name : str
        As the log has it; x0, x1, … where it has none.
    role : str
        ``sensor``, ``time``, ``temperature``, ``index``, ``counter``, ``other`` or ``text``.
    used : bool
        Whether it is read as a sensor, time or covariate by default.
    unit : str or None
        As the log says it; of a sensor that is used, as it was given.
    rate : float or None
        Of a clock, Hz.
    first : tuple of float
        Its first values.
    low, high : float
        Its extremes; NaN of text.
    doubts : tuple of str
        What to look at before trusting it.
    """

    name: str
    role: str
    used: bool
    unit: str | None
    rate: float | None
    first: tuple[float, ...]
    low: float
    high: float
    doubts: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        shown = {name: getattr(self, name) for name in self.__slots__}
        return {**shown, "first": list(self.first), "doubts": list(self.doubts)}


@dataclass(frozen=True, slots=True)
class Inspection:
    """What is understood of a log.

    Attributes
    ----------
    path : str
        The log.
    n : int
        Rows.
    rate, duration : float or None
        Sampling rate, Hz, and length, s, if they are known; None says that a rate is needed.
    problem : str or None
        Why it cannot be read as it is, with the remedy.
    columns : tuple of Column
        Every column.
    findings : tuple of Finding
        What the time stamps tell, what was guessed, and whether the sensor moves.
    """

    path: str
    n: int
    rate: float | None
    duration: float | None
    problem: str | None
    columns: tuple[Column, ...]
    findings: tuple[Finding, ...] = field(default=())
    refused: AllaniteError | None = field(default=None, repr=False, compare=False)
    """What `problem` says, for who words it."""

    def to_dict(self) -> dict[str, Any]:
        """``allanite/inspect/1``."""
        from allanite._kernels import version

        return {
            "schema": "allanite/inspect/1",
            "version": version(),
            "path": self.path,
            "n": self.n,
            "rate_hz": self.rate,
            "duration_s": self.duration,
            "problem": self.problem,
            "columns": [column.to_dict() for column in self.columns],
            "findings": [finding.to_dict() for finding in self.findings],
        }

    def __str__(self) -> str:
        return self.worded()

    def worded(self, words: Mapping[str, str] = CALL) -> str:
        """A table and the doubts, in the words of the command line or the page."""
        rate = (
            "rate not known" if self.rate is None else f"{self.rate:.6g} Hz, {self.duration:.6g} s"
        )
        lines = [f"{self.path} · {self.n} rows · {rate}"]
        head = ("column", "role", "unit", "first values", "range")
        rows = [
            (
                ("" if c.used else "–") + (c.name or "(no name)"),
                c.role + (f" {c.rate:.5g} Hz" if c.rate else ""),
                c.unit or "?" * (c.role == "sensor"),
                " ".join(f"{v:.6g}" for v in c.first),
                "" if c.low != c.low else f"{c.low:.4g} … {c.high:.4g}",
            )
            for c in self.columns
        ]
        widths = [max(len(row[k]) for row in (head, *rows)) for k in range(len(head))]
        lines += [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (head, *rows)
        ]
        if any(not c.used for c in self.columns):
            lines.append("– left out; naming the column takes it")
        open_ = [c.name for c in self.columns if UNITLESS in c.doubts]
        if open_:
            give = worded(f": {remedy_of(open_)}; or write it into the header", words)
            lines.append(f"! no unit in the log for {', '.join(open_)}{give} (gx [deg/s])")
        whole = [c.name for c in self.columns if COUNTS in c.doubts]
        if whole:
            lines.append(f"! {', '.join(whole)}: {COUNTS}")
        lines += [
            f"! {c.name}: {doubt}"
            for c in self.columns
            for doubt in c.doubts
            if doubt not in (UNITLESS, COUNTS)
        ]
        lines += [
            f"{'!' if f.severity == 'warning' else '·'} {f.worded(words)}" for f in self.findings
        ]
        if self.problem:
            lines.append(
                f"! {self.problem if self.refused is None else self.refused.worded(words)}"
            )
        return "\n".join(lines)


def inspect(path: Any, **options: Any) -> Inspection:
    r"""Say what is understood of a log: role, unit, rate and first values of every column.

    Parameters
    ----------
    path : str, Path or data frame
        As `allanite.read` takes it.
    **options
        Those of `allanite.read`.

    Returns
    -------
    Inspection
        A table when printed; `columns`, `rate`, `findings`, and `problem`: why it cannot be read yet, or None.

    Raises
    ------
    InputError
        The file cannot be opened as a log at all.

    Examples
    --------
    >>> with open("gyro.csv", "w", encoding="utf-8") as file:
    ...     file.writelines(["time [s],gx\n", *(f"{k / 100},{k % 7}\n" for k in range(200))])
    >>> seen = al.inspect("gyro.csv")
    >>> [(c.name, c.role, c.unit) for c in seen.columns]
    [('time', 'time', 's'), ('gx', 'sensor', None)]
    """
    from allanite.readers import read, read_table

    table, texts = (
        (table_of(path), {}) if is_frame(path) else _whole(path, read_table, options.get("topic"))
    )
    asked = options.get("column")
    columns = () if asked is None else (asked,) if isinstance(asked, str | int) else tuple(asked)
    covariates = options.get("covariate") or ()
    request = Request(
        options.get("rate"),
        options.get("unit"),
        options.get("quantity"),
        columns,
        (covariates,) if isinstance(covariates, str) else tuple(covariates),
        options.get("time_column"),
        options.get("piece"),
    )
    with about(None if is_frame(path) else path):
        # What is no unit says nothing of the log.
        _ = request.kinds
    used: set[int] = set()
    time: set[int | None] = set()
    # What is refused still has the rate that it states.
    stated = table.rate if request.rate is None else request.rate
    rate = stated if stated is not None and 0.0 < stated < np.inf else None
    refused, duration = None, None if rate is None else table.n / rate
    given: dict[str, str] = {}
    findings: tuple[Finding, ...] = ()
    try:
        choice = choose(table.names, table.units, request, stamped=table.time is not None)
        choice, _ = understand(table, choice, request)
        used, time = {*choice.samples, *choice.covariates}, {choice.time, choice.rest}
        if texts and not columns:
            options["column"] = [table.names[i] for i in choice.samples]
        recording = read(path, **options)
        rate, duration = recording.rate, recording.duration
        if request.unit is not None:
            given = dict(zip(recording.columns, recording.units, strict=True))
        moves = _moves(recording)
        # Of columns that motion is said which `moves` does not know; what is said of units stands by them.
        findings = (
            *moves,
            *(
                f
                for f in recording.audit
                if (f.column is None and f.kind not in ("no_unit", "moving"))
                or (f.kind == "not_static" and not moves)
            ),
        )
    except AllaniteError as error:
        refused = error
    views = [
        _column(table, i, given, used=i in used or i in time, time=i in time)
        for i in range(len(table.names))
    ]
    if table.time is not None:
        views.insert(0, _stamps(table.time))
    views += [
        Column(name, "text", False, None, None, (), np.nan, np.nan, (doubt,))
        for name, doubt in texts.items()
    ]
    shown = type(path).__name__ if is_frame(path) else plain(path)
    problem = None if refused is None else str(refused)
    return Inspection(shown, table.n, rate, duration, problem, tuple(views), findings, refused)


def _moves(recording: Recording) -> list[Finding]:
    """That a sensor moves at all; one without a unit, if it is in the unit that such sensors usually are in."""
    columns = recording.columns
    usual = usual_units(columns)
    if not usual or {parse_unit(unit).kind for unit in recording.units} != {FREQUENCY}:
        return finding_of(recording, LEAST)
    units = [usual_units([name]) for name in columns]
    tried = Recording(recording.samples, recording.rate, unit=units, columns=columns)
    found = finding_of(tried, LEAST)
    return [replace(one, found=f"if in {usual}: {one.found}") for one in found]


def _whole(
    path: Any, read_table: Any, topic: str | Sequence[str] | None
) -> tuple[Table, dict[str, str]]:
    """All columns of a file; those that hold text are left out, and why, by name."""
    path = Path(path)
    topics = (topic,) if isinstance(topic, str) else tuple(topic or ())
    found: list[str] = []
    texts: dict[int, str] = {}

    def everything(names: Sequence[str], _: Sequence[str | None]) -> list[int]:
        found[:] = names
        return list(range(len(names)))

    with about(path):
        try:
            return _kept(read_table(path, everything, topics)), {}
        except InputError:
            for at in range(len(found)):
                try:
                    read_table(path, lambda *_, at=at: [at], topics)
                except InputError as error:
                    texts[at] = error.found
            if not 0 < len(texts) < len(found):
                raise
        numeric = [at for at in range(len(found)) if at not in texts]
        table = _kept(read_table(path, lambda *_: numeric, topics))
        return table, {found[at]: why for at, why in texts.items()}


def _kept(table: Table) -> Table:
    """The columns that were read."""
    there = [i for i, column in enumerate(table.columns) if column is not None]
    return type(table)(
        tuple(table.names[i] for i in there),
        tuple(table.columns[i] for i in there),
        tuple(table.units[i] for i in there),
        table.rate,
        table.time,
        table.named,
    )


def _column(table: Table, at: int, given: Mapping[str, str], *, used: bool, time: bool) -> Column:
    name, x = table.names[at], table[at]
    unit = table.units[at] or given.get(name)
    role = "time" if time else role_of(name, unit)
    if role == "time" and not time and falls(x):
        role = "other"
    counts = kind_of(x)
    if role in ("sensor", "other") and counts and unit is None and not (used and role == "sensor"):
        role = "time" if counts == "clock" else counts
    finite = x[np.isfinite(x)] if x.dtype.kind == "f" else x
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
    doubts = []
    if role == "sensor" and unit is None:
        doubts.append(UNITLESS)
        if finite.size and high > low and bool((finite == np.round(finite)).all()):
            doubts.append(COUNTS)
    if role == "sensor" and finite.size and low == high:
        doubts.append("it never changes")
    if finite.size < x.size:
        doubts.append(f"{x.size - finite.size} values are missing")
    rate = None
    if role == "time":
        try:
            rate = read_stamps(x, unit if unit in ("s", "ms", "us", "ns") else None).rate
        except InputError as error:
            doubts.append(str(error))
    first = tuple(float(v) for v in x[:SHOWN])
    return Column(name, role, used, unit, rate, first, low, high, tuple(doubts))


def _stamps(time: NDArray[Any]) -> Column:
    """The time that a log keeps apart from its columns."""
    rate: float | None = None
    doubts: tuple[str, ...] = ()
    try:
        rate = read_stamps(time).rate
    except InputError as error:
        doubts = (str(error),)
    numbers = time.astype(np.int64) if time.dtype.kind in "mM" else np.asarray(time)
    real = numbers.dtype.kind in "iuf"
    first = tuple(float(v) for v in numbers[:SHOWN]) if real else ()
    low, high = (float(numbers.min()), float(numbers.max())) if real else (np.nan, np.nan)
    return Column("(time)", "time", True, None, rate, first, low, high, doubts)

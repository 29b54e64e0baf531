"""Decide role, unit, scale and use of every column of a log, in the same way for all commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.numbers import percent_text
from allanite.common.plain import plain
from allanite.common.unit_kinds import (
    FOREIGN,
    INTEGRAL,
    PHASE,
    RATE,
    kind_of_unit,
    seconds_in,
    time_unit,
)
from allanite.common.units import (
    ACCELERATION,
    ANGULAR_RATE,
    FREQUENCY,
    MAGNETIC_FIELD,
    is_frequency,
    rate_unit,
    unit_kind,
)
from allanite.readers._table import Table, time_unit_of
from allanite.readers.column_numbers import (
    falls_often,
    indices_of_magnitudes,
    is_serial_number,
    kind_of_numbers,
    repeats_exactly,
)
from allanite.readers.plausibility import without_wrong_units
from allanite.readers.time_parts import TimeParts, find_time_parts
from allanite.recording import find_column
from allanite.recording.findings import Finding, names_text
from allanite.recording.log_column import LogColumn
from allanite.recording.sensor_names import role_and_reason, role_of, sensor_kind, words_in
from allanite.recording.timebase import read_stamps

if TYPE_CHECKING:
    from allanite.common.read_options import ReadOptions

#: Minimum number of rows with which the first column of a log without names may be the time. Chosen by judgment; not
#: measured.
MIN_STAMPS = 100
#: Modified Julian Date of the beginning of 2000, and length of a year, days.
MJD_2000, YEAR = 51_544.5, 365.25
#: Modified Julian Date of the first GPS week: 6 January 1980.
GPS_EPOCH = 44_244
#: Remedy for a column that is not used.
USE_REMEDY = "; {column} reads a column as a sensor, {logged} as a temperature or another cause"
#: Kind of sensor → name of such a sensor with its article, for messages.
ARTICLES = {
    ANGULAR_RATE: "a gyroscope",
    ACCELERATION: "an accelerometer",
    FREQUENCY: "a clock",
    MAGNETIC_FIELD: "a magnetometer",
}


# -- roles ---------------------------------------------------------------------------------------


@dataclass(slots=True)
class Roles:
    """Roles of all columns of a table and the time columns, decided from names, units and numbers.

    The requested time column is the time. A requested covariate is neither sensor nor time. `reasons` say why columns
    with the role ``other`` are no sensors. `clocks` are columns that only their numbers show to be clocks. For a time in
    several columns, `time` is the coarsest one. `time_units` follow from the numbers of time columns. Raises `InputError`
    for an unknown time column.
    """

    table: Table
    options: ReadOptions
    roles: list[str] = field(init=False, default_factory=list)
    reasons: list[str] = field(init=False, default_factory=list)
    sources: list[str] = field(init=False, default_factory=list)
    clocks: set[int] = field(init=False, default_factory=set)
    time: int | None = field(init=False, default=None)
    parts: TimeParts | None = field(init=False, default=None)
    time_units: dict[int, str] = field(init=False, default_factory=dict)
    findings: list[Finding] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        """Decide the role of each column by its name and unit, then by its numbers, then find the time."""
        table = self.table
        for i, (name, unit) in enumerate(zip(table.names, table.units, strict=True)):
            role, reason = role_and_reason(name, unit) if table.named else ("sensor", "")
            if i in table.dates and role == "other":
                role, reason = "time", ""
            if i in table.texts:
                role, reason = "other", f'text, such as "{plain(table.texts[i], 24)}"'
            self.roles.append(role)
            self.reasons.append(reason)
            self.sources.append(table.source if table.named else "guess")
        for name in self.options.covariates:
            with suppress(InputError):  # `layout_from_roles` raises this error
                i = find_column(name, table.names)
                if self.roles[i] in ("sensor", "time"):
                    self._demote(i, "a logged column")
        self._demote_by_numbers()
        self._set_time_columns()

    @property
    def there(self) -> list[int]:
        """List of the indices of the columns that were read."""
        return [i for i, column in enumerate(self.table.columns) if column is not None]

    @property
    def time_columns(self) -> tuple[int, ...]:
        """Tuple of the indices of the columns that make up the time; empty without a time."""
        if self.parts is not None:
            return self.parts.columns
        return () if self.time is None else (self.time,)

    def with_role(self, role: str) -> list[int]:
        """List of the indices of the columns with this role."""
        return [i for i, own in enumerate(self.roles) if own == role]

    def shown_name(self, at: int) -> str:
        """Name of a column; a text with its index if the name is empty."""
        return self.table.names[at] or f"{at} (without a name)"

    def _demote(self, at: int, reason: str) -> None:
        """Set the role of the column at index `at` to ``other``, with this reason and the source ``guess``."""
        self.roles[at], self.reasons[at], self.sources[at] = "other", reason, "guess"

    def _demote_by_numbers(self) -> None:
        """Set the role ``other`` for sensors that are magnitudes, or whose values count, repeat or are constant.

        Besides magnitudes, only columns without a unit change, and only if samples are rates. The name of a sensor
        outweighs its numbers unless they rise in every row.
        """
        table = self.table
        sensors = [i for i in self.there if self.roles[i] == "sensor"]
        axes = [i for i in sensors if sensor_kind(table.names[i]) is None or table.named]
        for group in _groups_of_equal_unit(axes, table):
            for place in indices_of_magnitudes([table[i] for i in group]):
                self._demote(group[place], "a magnitude")
        if self.options.meaning not in (None, "rate"):
            return
        kinds: dict[int, str] = {}
        words = {"index": "an index", "counter": "a counter", "date": "a date", "clock": "a clock"}
        for i in sensors:
            if table.units[i] is not None or self.roles[i] != "sensor":
                continue
            x, is_named = table[i], sensor_kind(table.names[i]) is not None
            is_axis = is_named or not table.named or words_in(table.names[i]) in ("x", "y", "z")
            if not is_axis and len(sensors) > 1 and x.dtype.kind == "f" and np.isnan(x).all():
                kinds[i] = "no values"
                continue
            kind = kind_of_numbers(x)
            # The name of a sensor outweighs its numbers, unless they rise in every row.
            if kind is not None and not (is_named and np.any(np.diff(x) <= 0)):
                kinds[i] = words[kind]
            elif not is_axis and repeats_exactly(x):
                kinds[i] = "an identifier"
            elif not is_axis and is_serial_number(x):
                kinds[i] = "a constant whole number"
        if not any(i not in kinds and self.roles[i] == "sensor" for i in sensors):
            # No other sensor is left. Phases and angles rise like a time, and coarse codes repeat like identifiers.
            counts = () if len(table.names) == 1 else ("an index", "a counter", "a date")
            kinds = {i: kind for i, kind in kinds.items() if kind in counts}
        for i, kind in kinds.items():
            self._demote(i, kind)
        self.clocks = {i for i, kind in kinds.items() if kind == "a clock"}

    def _set_time_columns(self) -> None:
        """Set the time columns, their findings, and the reasons why other times are not used."""
        options = self.options
        # Stamps that are no column of the table are the time, unless another column is requested.
        apart = self.table.time is not None and options.time in (None, "t", "time")
        if not apart and not options.ignores_time:
            self._choose_time()
        time = self.time_columns
        for i in time:
            self.roles[i], self.reasons[i] = "time", ""
        others = [i for i in self.there if i not in time]
        # A column named like a time whose numbers fall is something else, such as a temperature T.
        for i in others:
            if self.roles[i] == "time" and falls_often(self.table[i]):
                self.roles[i], self.reasons[i] = "other", "its numbers fall, so it is no time"
        for i in others:
            if self.roles[i] == "time" or i in self.clocks:
                if self.parts is None:
                    self._compare_with_time(i)
                self.reasons[i] = "another time" if self.time is not None or apart else "a clock"

    def _choose_time(self) -> None:
        """Set `time`, `parts` and the source of the time, and add a finding if it is guessed or in several columns."""
        table, column = self.table, self.options.time
        parts = find_time_parts(table.names, table.columns, table.dates)
        if column is not None:
            self.time = find_column(column, table.names)
            self.sources[self.time] = "option"
        if parts is not None and (column is None or self.time in parts.columns):
            self.time, self.parts = parts.columns[0], parts
            names = ", ".join(table.names[i] for i in parts.columns)
            self.findings.append(
                Finding(
                    "time_parts",
                    "info",
                    f"the time is in {len(parts.columns)} columns, {parts.form}: {names}",
                    values={"count": len(parts.columns)},
                    remedy=" ({time_column} selects another)",
                )
            )
        elif column is None:
            self.time = self._named_time()
            if self.time is None and (guessed := self._guessed_time()) is not None:
                self.time, self.sources[guessed] = guessed, "guess"
                reason = "holds days (MJD)" if guessed in self.time_units else "rises steadily"
                self.findings.append(
                    Finding(
                        "time_column",
                        "info",
                        f"column {self.shown_name(guessed)} {reason} and is used as the time",
                        values={"column_index": guessed},
                        remedy=" ({column} reads it as a sensor)",
                    )
                )

    def _named_time(self) -> int | None:
        """Index of the first column with the role ``time`` whose numbers rise, or else of the first with it, or None."""
        table, candidates = self.table, self.with_role("time")
        advancing = [
            i
            for i in candidates
            if (x := table.columns[i]) is not None and not falls_often(x) and np.any(np.diff(x) > 0)
        ]
        return next(iter(advancing or candidates), None)

    def _guessed_time(self) -> int | None:
        """Index of the column whose numbers show that it is the time, or None; may change roles.

        For a pair of days (MJD) and decimal years, the days are the time, and columns with their GPS week get the role
        ``other``.
        """
        table = self.table
        pair = _days_and_years(table, self.there)
        if pair is not None:
            days, years = pair
            self.roles[years], self.time_units = "time", {days: "d", years: "y"}
            self.clocks -= set(pair)
            for i in self.there:
                if _is_gps_calendar(table[i], table[days]):
                    self._demote(i, "week or day of week of the same time")
            return days
        if not table.named and _looks_like_time(table):
            return 0
        unnamed = (
            i
            for i in self.there
            if i in self.clocks
            or (self.roles[i] == "other" and not self.reasons[i].startswith("a"))
        )
        return next(
            (i for i in unnamed if table.units[i] is None and kind_of_numbers(table[i]) == "clock"),
            None,
        )

    def _compare_with_time(self, other: int) -> None:
        """Add a finding that the time column `other` is not used; a warning if its rate differs by over 0.1 %."""
        at = self.time
        if at is None or self.table.columns[at] is None or {at, other} <= self.time_units.keys():
            return
        first, second = self.shown_name(at), self.shown_name(other)
        both = f"{first} and {second} are both time; {first} is used"
        ratio = _relative_rate_difference(self.table, at, other)
        odd = ratio > 1e-3
        self.findings.append(
            Finding(
                "two_clocks",
                "warning" if odd else "info",
                both + (f"; their rates differ by {percent_text(ratio, 2)}" if odd else ""),
                values={"relative": ratio},
                remedy=" (choose by {time_column})",
            )
        )


def _groups_of_equal_unit(columns: Sequence[int], table: Table) -> list[list[int]]:
    """List of groups of adjacent column indices with the same unit; each group is a list."""
    groups: list[list[int]] = []
    for i in columns:
        if groups and groups[-1][-1] == i - 1 and table.units[i] == table.units[groups[-1][-1]]:
            groups[-1].append(i)
        else:
            groups.append([i])
    return groups


def _days_and_years(table: Table, there: Sequence[int]) -> tuple[int, int] | None:
    """Indices (days, years) of the first columns with the same times in MJD and in decimal years, or None."""
    with np.errstate(all="ignore"):
        means = {i: float(np.mean(table[i])) for i in there}
    for days in (i for i in there if 15_000 < means[i] < 90_000):
        for years in (i for i in there if 1_900 < means[i] < 2_200):
            # Half-precision floats cannot hold the days of a century.
            of_years = MJD_2000 + (table[years].astype(np.float64) - 2000.0) * YEAR
            # Calendar dates differ by up to two days from years of 365.25 days.
            if np.all(np.abs(of_years - table[days]) < 2.0) and np.any(np.diff(table[days]) > 0):
                return days, years
    return None


def _is_gps_calendar(values: NDArray[Any], days: NDArray[Any]) -> bool:
    """True if the values are the GPS week, or the day of the GPS week, of `days` (MJD)."""
    since = np.floor(days) - GPS_EPOCH
    return bool(np.array_equal(values, since // 7) or np.array_equal(values, since % 7))


def _looks_like_time(table: Table) -> bool:
    """True if the first of several columns rises in every row by similar steps (median deviation below 50 %)."""
    if len(table.names) < 2 or table.columns[0] is None or table.n < MIN_STAMPS:
        return False
    with np.errstate(invalid="ignore", over="ignore"):  # infinities and NaN are no time
        steps = np.diff(table[0])
        return bool(np.all(steps > 0) and np.median(np.abs(steps / np.median(steps) - 1)) < 0.5)


def _relative_rate_difference(table: Table, one: int, two: int) -> float:
    """Relative difference |r₁/r₂ − 1| of the rates of two time columns; 0 if one of them has no positive rate.

    Unless both units are stated, the rates are compared up to a power of ten.
    """
    units = [time_unit_of(table.names[i], table.units[i]) for i in (one, two)]
    stated = None not in units
    try:
        rates = [
            read_stamps(table[i], unit if stated else "s").rate
            for i, unit in zip((one, two), units, strict=True)
        ]
    except InputError:
        return 0.0
    ratio = rates[0] / rates[1]
    if not ratio > 0.0:
        return 0.0
    return abs(ratio / (1.0 if stated else 10.0 ** round(float(np.log10(ratio)))) - 1)


# -- use -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Layout:
    """Decision about the columns of a log: which are read, with which units.

    `columns` are all columns, without sampling rates. `samples` and `covariates` are indices. `units` are those of the
    samples in the recording. `time_unit` is None if the header does not state it.
    """

    columns: tuple[LogColumn, ...]
    samples: tuple[int, ...]
    covariates: tuple[int, ...]
    units: tuple[str, ...]
    quantity: str
    roles: Roles
    time_unit: str | None
    findings: tuple[Finding, ...]

    @property
    def used(self) -> tuple[int, ...]:
        """Tuple of the indices of all columns that are read: samples, then covariates, then time, each index once."""
        time = self.roles.time_columns
        return tuple(dict.fromkeys((*self.samples, *self.covariates, *time)))


def layout_of(table: Table, options: ReadOptions) -> Layout:
    """`Layout` of a table, which may hold only the first rows: role, unit, scale and use of every column."""
    return layout_from_roles(Roles(table, options), options)


def layout_from_roles(found: Roles, options: ReadOptions) -> Layout:
    """`Layout` of a table from the roles of its columns.

    Columns named in the options replace the recognized sensors; named covariates are added to the temperatures. Raises
    `InputError` if no column is a sensor, a column is unknown, or a unit contradicts the given one.
    """
    table, names = found.table, found.table.names
    reasons, loud = list(found.reasons), set[int]()
    if options.columns:
        samples = tuple(dict.fromkeys(find_column(name, names) for name in options.columns))
    else:
        samples = _default_samples(found, options, reasons, loud)
    quantity = options.meaning
    if quantity is None:
        phases = all(kind_of_unit(table.units[i]) == PHASE for i in samples)
        quantity = "angle" if phases and options.unit is None else "rate"
    factors = _factors_of(options.scales, names, samples)
    stated, doubted = without_wrong_units(table, options.unit_by_kind)
    read = {i: _unit_and_scale(names[i], stated[i], options, quantity) for i in samples}
    layout = Layout(
        (),
        samples,
        _covariates(found, options, samples),
        tuple(unit for unit, _ in read.values()),
        quantity,
        found,
        None if found.time is None else _time_unit(found, found.time),
        (),
    )
    scales = {i: scale * factors.get(i, 1.0) for i, (_, scale) in read.items()}
    columns = _log_columns(layout, options, stated, scales, reasons)
    findings = (
        *found.findings,
        *doubted,
        *_phase_unit_findings([columns[i] for i in samples], quantity),
        *([] if options.columns else _findings_about_unused(columns, loud, options)),
    )
    return replace(layout, columns=columns, findings=findings)


def _factors_of(
    scales: Mapping[str, float], names: Sequence[str], samples: Sequence[int]
) -> dict[int, float]:
    """Factor by index of a column from `scales` by name; raises `InputError` if such a column is not in `samples`."""
    found = {}
    for name, factor in scales.items():
        at = find_column(name, names)
        if at not in samples:
            raise InputError(
                f"scale of column {names[at]}: the column is not used",
                remedy="; omit its scale, or select the column with {column}",
            )
        found[at] = factor
    return found


def _covariates(found: Roles, options: ReadOptions, samples: Sequence[int]) -> tuple[int, ...]:
    """Indices of the covariates: temperatures, then requested columns, without the `samples`."""
    table = found.table
    temperatures = [i for i in found.with_role("temperature") if i not in table.texts]
    requested = [find_column(name, table.names) for name in options.covariates]
    return tuple(i for i in dict.fromkeys((*temperatures, *requested)) if i not in samples)


def _log_columns(
    layout: Layout,
    options: ReadOptions,
    stated: Sequence[str | None],
    scales: Mapping[int, float],
    reasons: Sequence[str],
) -> tuple[LogColumn, ...]:
    """All columns of a table as `LogColumn`, with the sources of role, unit and scale; rates are not set.

    `stated` has the unit of each column that the log states, and `reasons` why each column is not used.
    """
    found, used, table = layout.roles, set(layout.used), layout.roles.table
    scaled = {find_column(name, table.names) for name in options.scales}
    columns = []
    for i, (name, unit) in enumerate(zip(table.names, stated, strict=True)):
        role, source = found.roles[i], found.sources[i]
        if i in layout.samples and role != "sensor":
            role, source = "sensor", "option"
        elif i in layout.covariates and role != "temperature":
            source = "option"
        reason = "" if i in used else reasons[i]
        if options.columns and i not in used and role == "sensor":
            reason = "not named as a column to use"
        sources = {"name": table.source if table.named else "guess", "role": source}
        if role == "time" and unit is None and not (found.parts and i in found.time_columns):
            unit = _time_unit(found, i)
        phase = i in layout.samples and layout.quantity != "rate"
        if phase and is_frequency(unit) and time_unit(options.unit):
            # A header may state a wrong unit, such as 1; the given unit of time says that the numbers are a phase.
            unit = None
        if unit is not None:
            sources["unit"] = "guess" if i in found.time_units else table.source
        elif i in layout.samples and options.unit is not None:
            several = "," in options.unit
            unit = layout.units[layout.samples.index(i)] if several else options.unit
            sources["unit"] = "option"
        scale = scales.get(i, 1.0)
        if scale != 1.0:
            sources["scale"] = "option" if i in scaled else sources["unit"]
        columns.append(LogColumn(name, role, i in used, unit, scale, None, reason, sources))
    return tuple(columns)


def _phase_unit_findings(columns: Sequence[LogColumn], quantity: str) -> list[Finding]:
    """At most one warning, about the columns that are read as a phase although they have the unit of a frequency."""
    if quantity == "rate":
        return []
    names = [c.name for c in columns if is_frequency(c.unit)]
    if not names:
        return []
    unit = next(c.unit for c in columns if is_frequency(c.unit))
    return [
        Finding(
            "phase_unit",
            "warning",
            f"{names_text(names)} has unit {unit}, the unit of a fractional frequency, but is read as a phase in s",
            remedy=": leave {quantity:angle} out, or state that the numbers are in s with {this_unit:s}",
        )
    ]


def _time_unit(found: Roles, at: int) -> str | None:
    """Unit of the time column at index `at` if a date, name, unit or guess states it; else None."""
    table = found.table
    if at in table.dates:
        return "s"
    unit = found.time_units.get(at) or time_unit_of(table.names[at], table.units[at])
    if unit == "100us" and table.rate is not None and table.columns[at] is not None:
        # SampleTimeFine of Xsens is in 0.1 ms in MT Manager and in 1 µs in the Movella DOT. The stated rate decides.
        samples = float(np.median(np.diff(table[at]))) * table.rate
        return "us" if abs(samples * 1e-6 - 1.0) < abs(samples * 1e-4 - 1.0) else unit
    return unit


def _default_samples(
    found: Roles, options: ReadOptions, reasons: list[str], loud: set[int]
) -> tuple[int, ...]:
    """Indices, ascending, of the columns that are read as samples if the caller names none.

    Writes why each other sensor is not read into `reasons`, and its index into `loud` if a warning is due. Without a unit
    or quantity in `options`, clock phases are read only if no inertial sensor is logged. Raises `InputError` without a
    sensor.
    """
    table, names, units = found.table, found.table.names, found.table.units
    sensors = [i for i in found.with_role("sensor") if i not in found.time_columns]
    foreign = [
        i
        for i, unit in enumerate(units)
        if kind_of_unit(unit) == FOREIGN and role_of(names[i], None) == "sensor"
    ]
    loud.update(i for i in foreign if found.roles[i] == "other")
    for i in foreign:
        reasons[i] = f"the unit {units[i]} is not understood"
    named = {i: sensor_kind(names[i]) for i in sensors}
    kinds = {i: kind_of_unit(units[i]) for i in sensors}
    chosen = [i for i in sensors if named[i] in options.unit_by_kind]
    if chosen:
        # A unit for one kind of sensor selects this kind in a file with gyroscopes and accelerometers.
        for i in (i for i in sensors if i not in chosen):
            article = ARTICLES.get(named[i] or "")
            reasons[i] = (
                f"{article}, but {options.unit} is no unit of {article}"
                if article
                else f"its name does not show that its unit is {options.unit}"
            )
            loud.add(i)
        return tuple(chosen)
    if table.named and any(named.values()):
        # Autopilots also log motors, set points and errors without a unit.
        for i in (i for i in sensors if not named[i] and kinds[i] is None):
            reasons[i] = "no unit, and not named like a sensor"
        sensors = [i for i in sensors if named[i] or kinds[i] is not None]
    inertial = any(named[i] or unit_kind(units[i]) in (ANGULAR_RATE, ACCELERATION) for i in sensors)
    if options.meaning is None:
        phases = [i for i in sensors if kinds[i] == PHASE]
        rates = [i for i in sensors if kinds[i] not in (PHASE, INTEGRAL)]
        if options.unit is None and phases and not inertial:
            for i in (i for i in sensors if i not in phases):
                reasons[i] = "the phase of a clock is read instead"
            return tuple(phases)
        if rates:
            for i in (i for i in sensors if i not in rates):
                reasons[i] = f"its unit {units[i]} is not that of a rate"
            return tuple(rates)
    if sensors:
        return tuple(sensors)
    if foreign and options.unit == "1":
        # The caller takes any unit: a series of heights in mm.
        return tuple(foreign)
    raise _no_sensor_error(table, foreign)


def _no_sensor_error(table: Table, foreign: Sequence[int]) -> InputError:
    """`InputError` (not raised) that no column is a sensor; it names those with a `foreign` unit (indices), or all."""
    if not foreign:
        return InputError(
            f"no sensor column found among {', '.join(table.names) or 'no columns'}",
            missing="column",
            remedy=": select it with {column}",
        )
    units = [table.units[i] or "" for i in foreign]
    shown = ", ".join(f"{table.names[i]} ({table.units[i]})" for i in foreign)
    counter = ", for a counter Hz/10MHz" if any("Hz" in unit for unit in units) else ""
    return InputError(
        f"no sensor column found: {shown} has no unit of a sensor",
        missing="column",
        remedy=": select it with {column} and add {unit}" + counter,
    )


def _findings_about_unused(
    columns: Sequence[LogColumn], loud: set[int], options: ReadOptions
) -> list[Finding]:
    """At most one finding, about the unused columns with reasons; a warning if `loud` is not empty."""
    groups: dict[str, list[str]] = {}
    for i, column in enumerate(columns):
        if not column.used:
            groups.setdefault(column.reason or "not needed", []).append(
                column.name or f"{i} (without a name)"
            )
    if not groups:
        return []
    listed = "; ".join(f"{names_text(names)} ({reason})" for reason, names in groups.items())
    both = (
        "; two units, such as deg/s,m/s^2, read both kinds"
        if loud and len(options.unit_by_kind) == 1
        else ""
    )
    return [
        Finding(
            "not_used",
            "warning" if loud else "info",
            f"not used: {listed}" + both,
            values={"count": sum(map(len, groups.values()))},
            remedy="" if both else USE_REMEDY,
        )
    ]


# -- units ---------------------------------------------------------------------------------------


def _unit_and_scale(
    name: str, own: str | None, options: ReadOptions, quantity: str
) -> tuple[str, float]:
    """Tuple (unit in the recording, factor on the numbers) of a sample column.

    The unit is the given one, or else `own`, which the log states, or else ``"1"``. Phases are converted to s; other
    factors are 1. Raises `InputError` if the given unit contradicts the header, or a phase is read as a rate.
    """
    given = _given_unit(name, own, options)
    if quantity != "rate" and PHASE in (kind_of_unit(own), kind_of_unit(given)):
        stated = own if kind_of_unit(own) == PHASE else given
        assert stated is not None
        same = given is None or given == "1" or time_unit(given) in (time_unit(stated), "s")
        moving = kind_of_unit(own) == RATE and not is_frequency(own)
        if own is not None and (moving or not same):
            raise _unit_contradiction(name, own, given or "")
        return "s", seconds_in(stated)
    if given is None:
        if kind_of_unit(own) == PHASE:
            raise InputError(
                f"column {name} is in {own}, which is no unit of a rate",
                missing="quantity",
                remedy=": if it is the phase of a clock, add {quantity:angle}",
            )
        return own or "1", 1.0
    if own is None:
        return given, 1.0
    try:
        own_rate_unit = rate_unit(own, quantity)
    except InputError:
        return given, 1.0
    if own_rate_unit.name != rate_unit(given, quantity).name:
        raise _unit_contradiction(name, own, given)
    return given, 1.0


def _unit_contradiction(name: str, own: str, given: str) -> InputError:
    """`InputError` (not raised) that the given unit contradicts the unit in the file."""
    return InputError(
        f"the file says that column {name} is in {own}",
        missing="unit",
        remedy=f", but {{this_unit:{given}}} is given: omit it, or convert the results with {{to}}",
    )


def _given_unit(name: str, own: str | None, options: ReadOptions) -> str | None:
    """Unit that the caller gave for the column `name`; None if the caller gave none.

    Of units for several kinds of sensors, the unit `own` that the log states selects one, or else the name. Raises
    `InputError` if neither does; None if `own` is no unit of a sensor.
    """
    if len(options.unit_by_kind) < 2:
        return options.unit
    kind = sensor_kind(name)
    if own is not None:
        try:
            kind = rate_unit(own, options.meaning or "rate").kind
        except InputError:
            return None
    if kind not in options.unit_by_kind:
        raise InputError(
            f"the name of column {name} does not show which of {options.unit} is its unit",
            missing="column",
            remedy=": add a header line that names the sensors, or read the columns of one unit at a time with {column}",
        )
    return options.unit_by_kind[kind]

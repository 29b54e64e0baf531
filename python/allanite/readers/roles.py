"""Decide the role of every column of a log: sensor, temperature, time or other, by its name, unit and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.numbers import percent_text
from allanite.common.plain import plain
from allanite.readers._table import Table, time_unit_of
from allanite.readers.column_numbers import (
    falls_often,
    indices_of_magnitudes,
    is_serial_number,
    kind_of_numbers,
    repeats_exactly,
)
from allanite.readers.time_parts import TimeParts, find_time_parts
from allanite.recording import find_column
from allanite.recording.findings import Finding
from allanite.recording.sensor_names import role_and_reason, sensor_kind, words_in
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
#: Result of `kind_of_numbers` → why such a column is no sensor.
COUNTS = {"index": "an index", "counter": "a counter", "date": "a date", "clock": "a clock"}


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

        Besides magnitudes, only columns without a unit change, and only if samples are rates. A column with the name of
        a sensor changes only if its numbers count and rise in every row. If no sensor would be left, only indices,
        counters and dates change, and nothing in a log of one column.
        """
        table = self.table
        sensors = [i for i in self.there if self.roles[i] == "sensor"]
        axes = [i for i in sensors if sensor_kind(table.names[i]) is None or table.named]
        for group in _groups_of_equal_unit(axes, table):
            for place in indices_of_magnitudes([table[i] for i in group]):
                self._demote(group[place], "a magnitude")
        if self.options.meaning not in (None, "rate"):
            return
        kinds = {
            i: reason
            for i in sensors
            if table.units[i] is None and self.roles[i] == "sensor"
            if (reason := _reason_by_numbers(table, i, is_alone=len(sensors) == 1))
        }
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


def _reason_by_numbers(table: Table, at: int, *, is_alone: bool) -> str:
    """Why the numbers of the column at index `at` are no samples; empty if they may be. `is_alone`: no other sensor.

    The name of a sensor or of an axis outweighs repeated and constant numbers.
    """
    x, name = table[at], table.names[at]
    is_named = sensor_kind(name) is not None
    is_axis = is_named or not table.named or words_in(name) in ("x", "y", "z")
    if not is_axis and not is_alone and x.dtype.kind == "f" and np.isnan(x).all():
        return "no values"
    kind = kind_of_numbers(x)
    # The name of a sensor outweighs its numbers, unless they rise in every row.
    if kind is not None and not (is_named and np.any(np.diff(x) <= 0)):
        return COUNTS[kind]
    if is_axis:
        return ""
    if repeats_exactly(x):
        return "an identifier"
    return "a constant whole number" if is_serial_number(x) else ""


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
    """True if the first of several columns rises in every row by similar steps (median deviation below 50 %).

    False for fewer than 100 rows, or if the first column was not read.
    """
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

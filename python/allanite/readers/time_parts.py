"""Recognize and join a time in several columns: seconds and nanoseconds, GPS weeks, days, calendar dates."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.recording.sensor_names import words_in

#: Seconds of a day and of a week.
DAY, WEEK = 86_400.0, 604_800.0
#: Maximum value in a column of whole seconds: the year 2255, in seconds since 1970.
MAX_SECONDS = 9e9

# Names of columns of whole seconds and of their fraction. Both have the same stem: stamp.sec and stamp.nanosec.
_SECONDS = re.compile(r"^(?P<stem>.*?)(?:s|secs?|seconds?)$")
_FRACTION = re.compile(
    r"^(?P<stem>.*?)(?:(?P<ns>n(?:ano)?(?:s|secs?|seconds?))|(?P<us>(?:u|µ|micro)(?:s|secs?|seconds?))"
    r"|(?P<ms>m(?:illi)?(?:s|secs?|seconds?)))$"
)
#: Unit of the fraction → number of units per second.
_UNITS_PER_SECOND = {"ns": 1e9, "us": 1e6, "ms": 1e3}

# Names of the columns of a GPS time, and of days (MJD) with seconds of the day.
_WEEK = re.compile(r"^(gps_?)?(week|wn|wk)(_?(no|nr|num|number))?$")
_SECONDS_OF_WEEK = re.compile(
    r"^(gps_?)?(i_?tow|tow|sow|(milli)?(sec|secs|second|seconds|time|ms)_of_(the_)?(gps_)?week|week_?(sec|second)s?"
    r"|secs?|seconds?|time|millis|milliseconds|ms)(_(s|sec|ms))?$"
)
_MJD = re.compile(r"^m?jd(_?(no|day|date|int))?$")
_SECONDS_OF_DAY = re.compile(
    r"^(utc_?)?(sod|tod|(milli)?(sec|secs|second|seconds|time|ms)_of_(the_)?day|day_?(sec|second)s?|secs?|seconds?|time|s)"
    r"(_(s|sec|ms))?$"
)
# Names of the columns of a calendar date.
_YEAR, _DAY_OF_YEAR = re.compile(r"^(year|yyyy|yr)$"), re.compile(r"^(doy|day_?of_?year|ddd|day)$")
_MONTH, _DAY_OF_MONTH = re.compile(r"^(month|mm|mon)$"), re.compile(r"^(day|dd|day_of_month)$")
_SECONDS_OF_DATE = re.compile(r"^(sod|(sec|second)s?_of_day|utc_?sec\w*)$")
# Hours, minutes and seconds: pattern of the name, seconds per unit, and limit of the values.
_TIME_OF_DAY = (
    (re.compile(r"^(hours?|hh?|hr)$"), 3600.0, 24.0),
    (re.compile(r"^(minutes?|min|mi|mm)$"), 60.0, 60.0),
    (re.compile(r"^(seconds?|secs?|ss?|sec_of_min\w*)$"), 1.0, 61.0),
)


@dataclass(frozen=True, slots=True)
class TimeParts:
    """Several columns that together are the time.

    `columns` are their indices, the coarsest first. `seconds` returns the terms, in s, whose sum is the time, from the
    columns in this order. `form` describes them in messages.
    """

    form: str
    columns: tuple[int, ...]
    seconds: Callable[[Sequence[NDArray[Any]]], list[Array]]

    def joined(
        self, arrays: Sequence[NDArray[Any]], origin: Sequence[float] | None = None
    ) -> Array:
        """Time of each row, s, shape (n,). Zero is the start of the coarsest part of the first row, e.g. midnight.

        `origin` has the values of the first row of the log, if this is not the first row of `arrays`.
        """
        first = [
            x[:1] if origin is None else np.array(origin[i : i + 1]) for i, x in enumerate(arrays)
        ]
        terms, starts = self.seconds(arrays), self.seconds(first)
        # Differences of whole numbers are exact, so that the fractions are added last.
        total = terms[0] - starts[0]
        for term in terms[1:]:
            total = total + term
        return total


def find_time_parts(
    names: Sequence[str], columns: Sequence[NDArray[Any] | None], dates: frozenset[int]
) -> TimeParts | None:
    """`TimeParts` of columns that together are the time, recognized by names and first rows; None without any.

    Tried in this order: date and time of day; seconds and their fraction; GPS week and seconds; MJD and seconds;
    calendar. `dates` are columns of date-times as text, converted to seconds.
    """
    words = [words_in(name) for name in names]
    numbers = {i: x for i, x in enumerate(columns) if x is not None and i not in dates}
    moments = {i: x for i in sorted(dates) if (x := columns[i]) is not None}

    def column_named(pattern: re.Pattern[str], *excluded: int) -> int | None:
        """Index of the first column of numbers whose name matches, and that is not in `excluded`; None without any."""
        return next((i for i in numbers if i not in excluded and pattern.match(words[i])), None)

    date = next((i for i, x in moments.items() if _are_whole(x / DAY) and x.any()), None)
    times = (i for i, x in moments.items() if i != date and _are_between_0_and(x, DAY + 1))
    clock = next(times, None)
    if date is not None and clock is not None:
        return TimeParts(
            "a date and a time of day", (date, clock), lambda x: [x[0] * 1.0, x[1] * 1.0]
        )
    split = _seconds_and_fraction(names, columns)
    if split is not None:
        return split
    for coarse, fine, span, form in (
        (_WEEK, _SECONDS_OF_WEEK, WEEK, "GPS week and seconds of week"),
        (_MJD, _SECONDS_OF_DAY, DAY, "days (MJD) and seconds of day"),
    ):
        one = column_named(coarse)
        two = None if one is None else column_named(fine, one)
        if one is None or two is None or not _are_whole(numbers[one]):
            continue
        # iTOW and similar columns are in ms if they exceed the seconds of a week or day.
        in_ms = words[two].endswith(("ms", "millis", "milliseconds"))
        part = 1.0 if _are_between_0_and(numbers[two], span + 1) and not in_ms else 1e-3
        if _are_between_0_and(numbers[two], (span + 1) / part):
            return TimeParts(form, (one, two), lambda x, s=span, p=part: [x[0] * s, x[1] * p])  # type: ignore[misc]
    return _calendar_parts(column_named, numbers)


def _calendar_parts(
    column_named: Callable[..., int | None], numbers: Mapping[int, NDArray[Any]]
) -> TimeParts | None:
    """`TimeParts` of year, month and day (or day of year) and, if logged, the time of day; None without such columns.

    A whole day of the year that never rises needs a time of day.
    """
    year = column_named(_YEAR)
    if year is None or not _are_whole(numbers[year]) or not 1900 < float(numbers[year][0]) < 2200:
        return None
    month = column_named(_MONTH)
    day = column_named(_DAY_OF_YEAR if month is None else _DAY_OF_MONTH)
    if day is None:
        return None
    taken = [year, day] if month is None else [year, month, day]
    calendar = len(taken)
    factors: list[float] = []
    found = column_named(_SECONDS_OF_DATE, *taken)
    if found is not None:
        taken.append(found)
        factors.append(1.0)
    else:
        for pattern, factor, most in _TIME_OF_DAY:
            found = column_named(pattern, *taken)
            if found is None or not _are_between_0_and(numbers[found], most):
                break
            taken.append(found)
            factors.append(factor)
    whole_days = taken == [year, day] and _are_whole(numbers[day])
    if whole_days and not np.any(np.diff(numbers[day]) > 0):
        return None

    def seconds(x: Sequence[NDArray[Any]]) -> list[Array]:
        """Terms in s whose sum is the time since 1970: whole days, fraction of a day, then each time of day."""
        years = (np.asarray(x[0]).astype(np.int64) - 1970).astype("datetime64[Y]")
        start = years.astype("datetime64[M]")
        if calendar == 3:
            start += np.asarray(x[1]).astype(np.int64) - 1
        days = start.astype("datetime64[D]").astype(np.int64).astype(np.float64)
        whole = np.floor(x[calendar - 1])
        rest = (x[calendar - 1] - whole) * DAY
        times = [x[calendar + k] * factor for k, factor in enumerate(factors)]
        return [(days + whole - 1) * DAY, rest, *times]

    form = "year and day of year" if calendar == 2 else "year, month and day"
    return TimeParts(form + (" with the time of day" if factors else ""), tuple(taken), seconds)


def _seconds_and_fraction(
    names: Sequence[str], columns: Sequence[NDArray[Any] | None]
) -> TimeParts | None:
    """`TimeParts` of the first pair of columns such as ``stamp.sec`` and ``stamp.nanosec``, or None.

    Both columns must hold whole numbers, and the fraction must be below one second. Columns whose first rows were not
    read do not count.
    """
    keys = [name.strip().lower() for name in names]
    rests: dict[str, tuple[int, float]] = {}
    for at, key in enumerate(keys):
        match = _FRACTION.match(key)
        if match is not None:
            rests.setdefault(match["stem"], (at, _UNITS_PER_SECOND[str(match.lastgroup)]))
    for at, key in enumerate(keys):
        match = _SECONDS.match(key)
        rest, parts = (None, 1.0) if match is None else rests.get(match["stem"], (None, 1.0))
        if rest is None or rest == at:
            continue
        seconds, fraction = columns[at], columns[rest]
        if seconds is None or fraction is None:
            continue
        if (
            _are_whole(seconds)
            and _are_whole(fraction)
            and _are_between_0_and(fraction, parts)
            and np.abs(seconds).max() < MAX_SECONDS
        ):
            return TimeParts(
                "seconds and a fraction of a second",
                (at, rest),
                lambda x, p=parts: [x[0] * 1.0, x[1] / p],  # type: ignore[misc]
            )
    return None


def _are_whole(x: NDArray[Any]) -> bool:
    """True if all values are finite whole numbers; False if there are none."""
    return bool(x.size and np.isfinite(x).all() and np.all(x == np.rint(x)))


def _are_between_0_and(x: NDArray[Any], limit: float) -> bool:
    """True if all values are finite, at least 0 and below `limit`; False if there are none."""
    return bool(x.size and np.isfinite(x).all() and x.min() >= 0 and x.max() < limit)

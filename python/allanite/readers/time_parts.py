"""Recognize and join a time in several columns: seconds and nanoseconds, GPS weeks, days, calendar dates."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.readers.sensor_names import words_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

DAY, WEEK = 86_400.0, 604_800.0
#: Maximum value in a column of whole seconds: the year 2255, in seconds since 1970.
MAX_SECONDS = 9e9

_SECONDS = re.compile(r"^(?P<stem>.*?)(?:s|secs?|seconds?)$")
_REST = re.compile(
    r"^(?P<stem>.*?)(?:(?P<ns>n(?:ano)?(?:s|secs?|seconds?))|(?P<us>(?:u|µ|micro)(?:s|secs?|seconds?))"
    r"|(?P<ms>m(?:illi)?(?:s|secs?|seconds?)))$"
)
#: Unit → number of units per second.
_PARTS = {"ns": 1e9, "us": 1e6, "ms": 1e3}

_WEEK = re.compile(r"^(gps_?)?(week|wn|wk)(_?(no|nr|num|number))?$")
_OF_WEEK = re.compile(
    r"^(gps_?)?(i_?tow|tow|sow|(milli)?(sec|secs|second|seconds|time|ms)_of_(the_)?(gps_)?week|week_?(sec|second)s?"
    r"|secs?|seconds?|time|millis|milliseconds|ms)(_(s|sec|ms))?$"
)
_MJD = re.compile(r"^m?jd(_?(no|day|date|int))?$")
_OF_DAY = re.compile(
    r"^(utc_?)?(sod|tod|(milli)?(sec|secs|second|seconds|time|ms)_of_(the_)?day|day_?(sec|second)s?|secs?|seconds?|time|s)"
    r"(_(s|sec|ms))?$"
)
_YEAR, _DAY_OF_YEAR = re.compile(r"^(year|yyyy|yr)$"), re.compile(r"^(doy|day_?of_?year|ddd|day)$")
_MONTH, _DAY_OF_MONTH = re.compile(r"^(month|mm|mon)$"), re.compile(r"^(day|dd|day_of_month)$")
_CLOCK = (
    (re.compile(r"^(hours?|hh?|hr)$"), 3600.0, 24.0),
    (re.compile(r"^(minutes?|min|mi|mm)$"), 60.0, 60.0),
    (re.compile(r"^(seconds?|secs?|ss?|sec_of_min\w*)$"), 1.0, 61.0),
)


@dataclass(frozen=True, slots=True)
class TimeParts:
    """Columns whose sum is the time.

    Attributes
    ----------
    form : str
        Description of the columns, for messages.
    columns : tuple of int
        Indices of the columns, the coarsest first.
    seconds : callable
        Function of the columns (arrays of shape (n,), in the order of `columns`) that returns terms in seconds, whose
        sum is the time.
    """

    form: str
    columns: tuple[int, ...]
    seconds: Callable[[Sequence[NDArray[Any]]], list[NDArray[np.float64]]]

    def joined(
        self, arrays: Sequence[NDArray[Any]], origin: Sequence[float] | None = None
    ) -> NDArray[np.float64]:
        """Time of each row, s, shape (n,). Zero is the start of the coarsest part of the first row, e.g. midnight.

        Parameters
        ----------
        arrays : sequence of ndarray of shape (n,)
            The columns.
        origin : sequence of float, optional
            Values of the columns in the first row of the log. Default: the first row of `arrays`.
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


def find_parts(
    names: Sequence[str],
    columns: Sequence[NDArray[Any] | None],
    dates: frozenset[int] = frozenset(),
) -> TimeParts | None:
    """Columns that together are the time, recognized by names and first rows; None if there are none.

    Parameters
    ----------
    names : sequence of str
        Names of all columns.
    columns : sequence of (ndarray of shape (n,) or None)
        First rows of each column.
    dates : frozenset of int
        Columns of date-times as text, converted to seconds.
    """
    words = [words_in(name) for name in names]

    def at(pattern: re.Pattern[str], besides: tuple[int, ...] = ()) -> int | None:
        """Index of the first column whose name matches a pattern and that is not in `besides`; None without any."""
        return next(
            (
                i
                for i, word in enumerate(words)
                if i not in besides
                and pattern.match(word)
                and columns[i] is not None
                and i not in dates
            ),
            None,
        )

    def rows(i: int) -> NDArray[Any]:
        """Values of the first rows of a column."""
        found = columns[i]
        assert found is not None
        return found

    date = next(
        (i for i in sorted(dates) if columns[i] is not None and _are_whole_days(rows(i))), None
    )
    clock = next(
        (
            i
            for i in sorted(dates)
            if i != date and columns[i] is not None and _all_below(rows(i), DAY + 1)
        ),
        None,
    )
    if date is not None and clock is not None:
        return TimeParts(
            "a date and a time of day", (date, clock), lambda x: [x[0] * 1.0, x[1] * 1.0]
        )
    split = _seconds_and_rest(names, columns)
    if split is not None:
        return split
    for coarse, fine, span, form in (
        (_WEEK, _OF_WEEK, WEEK, "GPS week and seconds of week"),
        (_MJD, _OF_DAY, DAY, "days (MJD) and seconds of day"),
    ):
        one = at(coarse)
        two = None if one is None else at(fine, (one,))
        if one is None or two is None or not _are_whole(rows(one)):
            continue
        # iTOW and similar columns are in ms if they exceed the seconds of a week or day.
        part = 1e-3 if not _all_below(rows(two), span + 1) else 1.0
        if words[two].endswith(("ms", "millis", "milliseconds")):
            part = 1e-3
        if _all_below(rows(two), (span + 1) / part):
            return TimeParts(form, (one, two), lambda x, s=span, p=part: [x[0] * s, x[1] * p])  # type: ignore[misc]
    return _calendar(at, rows)


def _calendar(
    at: Callable[..., int | None], rows: Callable[[int], NDArray[Any]]
) -> TimeParts | None:
    """`TimeParts` of calendar columns (year, month and day or day of year, with the time of day if logged), or None.

    `at` finds a column by a pattern of its name, `rows` returns its values.
    """
    year = at(_YEAR)
    if year is None or not _are_whole(rows(year)) or not 1900 < float(rows(year)[0]) < 2200:
        return None
    month = at(_MONTH)
    day = at(_DAY_OF_MONTH if month is not None else _DAY_OF_YEAR)
    if day is None:
        return None
    taken = [year, day] if month is None else [year, month, day]
    calendar = len(taken)
    factors: list[float] = []
    second = re.compile(r"^(sod|(sec|second)s?_of_day|utc_?sec\w*)$")
    found = at(second, tuple(taken))
    if found is not None:
        taken.append(found)
        factors.append(1.0)
    else:
        for pattern, factor, most in _CLOCK:
            found = at(pattern, tuple(taken))
            if found is None or not _all_below(rows(found), most):
                break
            taken.append(found)
            factors.append(factor)
    if calendar == 2 and len(taken) == 2 and _are_whole(rows(day)) and not _advances(rows(day)):
        return None

    def seconds(x: Sequence[NDArray[Any]]) -> list[NDArray[np.float64]]:
        """Terms in s whose sum is the time since 1970: whole days, the fraction of a day, hours, minutes, seconds."""
        years = (np.asarray(x[0]).astype(np.int64) - 1970).astype("datetime64[Y]")
        if calendar == 3:
            months = years.astype("datetime64[M]") + (np.asarray(x[1]).astype(np.int64) - 1)
            start = months.astype("datetime64[D]").astype(np.int64).astype(np.float64)
        else:
            start = years.astype("datetime64[D]").astype(np.int64).astype(np.float64)
        whole = np.floor(x[calendar - 1])
        rest = (x[calendar - 1] - whole) * DAY
        times = [x[calendar + k] * factor for k, factor in enumerate(factors)]
        return [(start + whole - 1) * DAY, rest, *times]

    form = "year and day of year" if calendar == 2 else "year, month and day"
    return TimeParts(form + (" with the time of day" if factors else ""), tuple(taken), seconds)


def _seconds_and_rest(
    names: Sequence[str], columns: Sequence[NDArray[Any] | None]
) -> TimeParts | None:
    """`TimeParts` of two columns for whole seconds and their fraction, such as ``stamp.sec`` and ``stamp.nanosec``.

    Or None.
    """
    keys = [name.strip().lower() for name in names]
    rests: dict[str, tuple[int, float]] = {}
    for at, key in enumerate(keys):
        match = _REST.match(key)
        if match is not None:
            rests.setdefault(match["stem"], (at, _PARTS[str(match.lastgroup)]))
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
            and _all_below(fraction, parts)
            and np.abs(seconds).max() < MAX_SECONDS
        ):
            return TimeParts(
                "seconds and a fraction of a second",
                (at, rest),
                lambda x, p=parts: [x[0] * 1.0, x[1] / p],  # type: ignore[misc]
            )
    return None


def _are_whole(x: NDArray[Any]) -> bool:
    """True if all values are finite whole numbers."""
    return bool(x.size and np.isfinite(x).all() and np.all(x == np.rint(x)))


def _are_whole_days(x: NDArray[Any]) -> bool:
    """True if all values in seconds are whole days, and not all are 0."""
    return _are_whole(x) and bool(np.all(x % DAY == 0) and np.abs(x).max() >= DAY)


def _all_below(x: NDArray[Any], most: float) -> bool:
    """True if all values are finite, not negative and below `most`."""
    return bool(x.size and np.isfinite(x).all() and x.min() >= 0 and x.max() < most)


def _advances(x: NDArray[Any]) -> bool:
    """True if the values rise at least once."""
    return bool(np.any(np.diff(x) > 0))

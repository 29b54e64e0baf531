"""Unit of a time column: date-times, s, ms, µs or ns, from their type, rate or magnitude."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.errors import InputError

#: Units of stamps, s. A day has 86 400 s, a year 365.25 days.
TIME_UNITS = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12, "min": 60.0, "h": 3600.0, "d": 86400.0,
    "week": 604800.0, "y": 31557600.0, "100us": 1e-4
}  # fmt: skip

# Spacing in the column's own numbers above which the next smaller unit is likelier. Spacings below 2 are seconds (faster
# than 0.5 Hz), 2…500 are milliseconds (2…500 Hz), 500…2e5 are microseconds.
_SPACING_LIMITS = ((2.0, "s"), (500.0, "ms"), (2e5, "us"), (math.inf, "ns"))
# Seconds since 1970 of the years 2000 to 2100: numbers in this range show their unit. Nanoseconds since a telephone was
# switched on a week ago would be microseconds of 1991.
PRESENT = (9.4e8, 4.1e9)
# Share of steps of two or more above which whole numbers are not rounded seconds.
_MAX_LONG_STEPS = 0.1
# Range of sampling rates of logs, Hz. Numbers as large as seconds since 1970 with a rate outside are counters.
_EPOCH_RATES = (1e-2, 1e6)
# Stamps of the years 1900 to 2100 in units of the calendar.
_CALENDARS = (
    ("days, as Modified Julian Dates are", "d", (15_020.0, 88_069.0)),
    ("decimal years", "y", (1_900.0, 2_100.0)),
)
# Intervals, s, at which clocks, satellites, stations and tide gauges are logged, up to a week, a month and a year. Few
# sensors have such an interval.
_CADENCES = (
    *(1, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, TIME_UNITS["d"], TIME_UNITS["week"]),
    *(TIME_UNITS["y"] / 12, TIME_UNITS["y"]),
)
# Years of 365 or 366 days, and stamps printed with few digits, differ by this much from a cadence.
_SAME_CADENCE = 0.005


def unusable_stamps(found: str, link: str = "; ") -> InputError:
    """`InputError` (not raised) for time stamps without a use. `link` connects the problem with the remedy."""
    remedy = f"{link}give {{rate}} and leave the column out"
    return InputError(found, missing="rate", remedy=remedy)


def stamp_numbers(time: ArrayLike, unit: str | None) -> tuple[NDArray[Any], str | None]:
    """Stamps as integers or floats, shape (n,), and their unit: ``"ns"`` for date-times, else the given one.

    `time` has numbers, date-times of numpy, pandas, polars or Python, or ISO 8601 texts. Raises `InputError` for NaT, NaN
    and other text, and for anything but one column of at least two stamps.
    """
    t = np.asarray(time)
    if t.ndim != 1 or t.size < 2:
        raise InputError(
            f"the time column needs at least two stamps in one column, found shape {t.shape}"
        )
    if t.dtype.kind in "OUST":
        t = _dates_or_floats(t)
    if t.dtype.kind in "mM":
        _require_valid(np.isnat(t), t)
        return t.astype(f"{t.dtype.kind}8[ns]").astype(np.int64), "ns"
    if t.dtype.kind not in "iufb":
        raise unusable_stamps(f"the time column holds {t.dtype}", ": ")
    if t.dtype.kind == "f":
        _require_valid(~np.isfinite(t), t)
        return t.astype(np.float64), unit
    return t.astype(np.int64), unit


def _dates_or_floats(t: NDArray[Any]) -> NDArray[Any]:
    """datetime64[ns] in UTC of date-times or ISO texts, or floats if the values are texts of numbers.

    Raises `InputError` for other values.
    """
    try:
        naive = [str(v).strip().removesuffix("Z").removesuffix("+00:00") for v in t.tolist()]
        # 31.01.2026 12:00:00.5: the day first.
        naive = [f"{v[6:10]}-{v[3:5]}-{v[:2]}{v[10:]}" if v[2:6:3] == ".." else v for v in naive]
        return np.array(naive, dtype="datetime64[ns]")
    except (ValueError, TypeError):
        pass
    try:
        return t.astype(np.float64)
    except (ValueError, TypeError):
        raise InputError(
            f"the time column holds {t.tolist()[0]!r} at row 0: neither a number nor an ISO 8601 date-time"
            " (2026-01-31T12:00:00.5)"
        ) from None


def _require_valid(bad: NDArray[np.bool_], t: NDArray[Any]) -> None:
    """Raise `InputError` if any stamp is flagged in `bad`; the message names the row of the first."""
    if bad.any():
        row = int(np.argmax(bad))
        raise unusable_stamps(
            f"the time column holds {t[row]} at row {row} ({int(bad.sum())} such in all): remove"
            " these rows",
            ", or ",
        )


def unit_of_stamps(t: NDArray[Any], step: float, rate: float | None) -> tuple[str, str]:
    """Unit of time stamps, and its source: ``"rate"``, ``"epoch"``, ``"usual"`` (fractions of a second) or ``"size"``.

    `step` is the usual step, and the stated `rate` (Hz) decides if it fits one unit. Without it, raises `InputError` for
    whole numbers in steps of 1 or 2, which may be seconds, milliseconds or row numbers, and for stamps that may be
    Modified Julian Dates or decimal years.
    """
    if rate is not None and rate > 0:
        for unit in ("s", "ms", "us", "ns"):
            if 1 / 3 < step * TIME_UNITS[unit] * rate < 3:
                return unit, "rate"
    middle = abs(float(t[t.size // 2]))
    for unit in ("s", "ms", "us", "ns"):
        second = TIME_UNITS[unit]
        present = PRESENT[0] < middle * second < PRESENT[1]
        if present and _EPOCH_RATES[0] < 1 / (step * second) < _EPOCH_RATES[1]:
            return unit, "epoch"
    _require_unit_of_calendar(float(t[0]), float(t[-1]), step, rate)
    some = t[:10_000]
    whole = t.dtype.kind == "i" or bool(np.all(some == np.rint(some)))
    constant = abs(step - round(step)) < 0.02
    if whole and constant and 0.9 < step < 2.1 and rate is None:
        raise InputError(
            f"the time stamps are whole numbers in steps of {step:.4g}: seconds ({1 / step:.4g} Hz),"
            f" milliseconds ({1e3 / step:.4g} Hz), days or row numbers?",
            missing="rate",
            remedy=" Give {rate}, or the unit in the header: time [s], time [ms], time [d]",
        )
    # Whole numbers 1, 2, 2, 1, … apart are rounded: to milliseconds, since 0.6 Hz is no usual rate.
    steps = np.diff(some)
    varied = whole and np.mean(steps > 1) > _MAX_LONG_STEPS
    limits = _SPACING_LIMITS[1:] if whole and (step > 1.0 or varied) else _SPACING_LIMITS
    unit = next(unit for limit, unit in limits if step <= limit)
    return unit, "usual" if unit == "s" and not whole else "size"


def _require_unit_of_calendar(start: float, end: float, step: float, rate: float | None) -> None:
    """Raise `InputError` if it is unclear whether stamps are seconds, Modified Julian Dates or decimal years.

    This is so if both ends are usual dates, the step is a usual interval, such as one day, and no rate is stated.
    """
    if rate is not None or not step > 0.0:
        return
    for name, unit, (first, last) in _CALENDARS:
        interval = step * TIME_UNITS[unit]
        usual = any(abs(interval / cadence - 1) < _SAME_CADENCE for cadence in _CADENCES)
        if first < start < last and first < end < last and usual:
            raise InputError(
                f"the time stamps from {start:.8g} on may be seconds ({1 / step:.4g} Hz) or {name}"
                f" (one sample in {interval:.6g} s)",
                missing="rate",
                remedy=f": give {{rate}}, or the unit in the header: time [s], time [{unit}]",
            )

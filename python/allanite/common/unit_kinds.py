"""Kinds of quantities of units in headers, and names of units of time."""

from __future__ import annotations

import re

from allanite.common.errors import InputError
from allanite.common.units import conversion, rate_unit, unit_kind

#: An angular rate, an acceleration, a magnetic field or a fractional frequency.
RATE = "rate"
#: An angle or a velocity: the integral of a rate.
INTEGRAL = "integral"
#: A unit of time that is used for the phase of clocks.
PHASE = "phase"
#: A unit of time that is not used for phases.
TIME_ONLY = "time"
#: Any other text.
FOREIGN = "foreign"

#: Units of time in which phases of clocks are logged.
_PHASE_UNITS = ("s", "ms", "us", "ns", "ps")
#: Spellings of units of time, in lower case without a plural s.
_TIME_UNITS = {
    "s": "s", "sec": "s", "second": "s", "ms": "ms", "msec": "ms", "milli": "ms", "millisecond": "ms",
    "us": "us", "usec": "us", "micro": "us", "microsecond": "us", "ns": "ns", "nsec": "ns", "nano": "ns",
    "nanosecond": "ns", "ps": "ps", "picosecond": "ps", "min": "min", "minute": "min", "h": "h", "hr": "h", "hour": "h",
    "d": "d", "day": "d", "mjd": "d", "jd": "d", "y": "y", "yr": "y", "year": "y", "a": "y", "week": "week",
}  # fmt: skip


def time_unit(unit: str | None) -> str | None:
    """Short name of a unit of time, such as ``s`` for ``seconds`` or ``us`` for ``µs``; None for any other text."""
    text = (unit or "").strip().replace("µ", "u").replace("μ", "u").lower()
    return _TIME_UNITS.get(text) or _TIME_UNITS.get(
        text.removesuffix("s") if len(text) > 2 else text
    )


def seconds_in(unit: str) -> float:
    """Length of a unit of time in s: 1e-9 for ``ns``. Raises `InputError` if the unit is not a time."""
    return conversion(time_unit(unit) or unit, "s") if time_unit(unit) != "ps" else 1e-12


def kind_of_unit(unit: str | None) -> str | None:
    """Kind of a unit: ``"rate"``, ``"integral"``, ``"phase"``, ``"time"`` or ``"foreign"``; None if the unit is None.

    ``"rate"`` is what a sensor measures (deg/s, m/s², 1), ``"integral"`` its integral over time (deg, m/s), ``"phase"``
    s to ps, ``"time"`` any other unit of time, and ``"foreign"`` none of these, or a bare number other than 1.
    """
    if unit is None:
        return None
    time = time_unit(unit)
    if time is not None and unit.strip() not in ("a",):
        return PHASE if time in _PHASE_UNITS else TIME_ONLY
    if re.fullmatch(r"\s*[\d.]+\s*", unit) and unit.strip() != "1":
        return FOREIGN
    if unit_kind(unit) is not None:
        return RATE
    try:
        rate_unit(unit, "angle")
    except InputError:
        return FOREIGN
    return INTEGRAL

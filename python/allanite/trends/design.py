"""The known functions of a trend (offset, rate, steps, annual and semi-annual terms), and times of steps as text."""

from __future__ import annotations

import datetime as dt
import math
import re
from dataclasses import dataclass

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.numbers import YEAR

#: Name of a unit of time for a rate → its length, s.
PER = {"year": YEAR, "day": 86400.0, "hour": 3600.0, "second": 1.0}
#: Time of J2000.0 (2000-01-01T12:00:00), s since 1970.
J2000 = 946728000.0
#: Pattern of a time since the first sample (``3.5yr``), and the length of its units, s.
_SPAN = re.compile(r"\+?(?P<number>\d+(?:\.\d*)?|\.\d+)\s*(?P<unit>s|h|d|y|yr)")
_SPANS = {"s": 1.0, "h": 3600.0, "d": 86400.0, "y": YEAR, "yr": YEAR}
#: Pattern of a decimal year (``2012.17``).
_DECIMAL = re.compile(r"(?:19|20|21)\d\d(?:\.\d*)?")


@dataclass(frozen=True)
class Functions:
    """Known functions of time of a trend: offset, rate, steps, then cosine and sine of each period.

    The offset refers to the time `middle`, s; the rate is per `per` seconds. The periodic terms have phase 0 at `origin`,
    s.
    """

    middle: float
    per: float
    steps: tuple[float, ...]
    periods: tuple[float, ...]
    origin: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Tuple of the name of each function, in the order of the rows of `at`: offset, rate, step, cosine or sine."""
        waves = ("cosine", "sine") * len(self.periods)
        return ("offset", "rate", *("step",) * len(self.steps), *waves)

    def at(self, times: Array) -> Array:
        """Design matrix: values of all functions at the times (s), shape (2 + steps + 2 · periods, n)."""
        rows = [np.ones(times.size), (times - self.middle) / self.per]
        rows += [(times >= step).astype(float) for step in self.steps]
        for period in self.periods:
            turn = 2.0 * np.pi * (times - self.origin) / period
            rows += [np.cos(turn), np.sin(turn)]
        return np.array(rows)


def seconds_of(text: str, epoch: float | None) -> float:
    """Seconds since the first sample of a date or a time span, given as text; dates without a time zone are in UTC.

    `text` is such as ``2012-03-04``, ``2012.17``, ``120d``, ``3.5yr`` or ``86400s``. `epoch` is the time of the first
    sample, s since 1970, if the log has dates. Raises `InputError` for a text that is not a time, and for a date if
    `epoch` is None.
    """
    text = text.strip()
    span = _SPAN.fullmatch(text)
    if span is not None:
        return float(span["number"]) * _SPANS[span["unit"]]
    if _DECIMAL.fullmatch(text):
        date = (float(text) - 2000.0) * YEAR + J2000
    else:
        try:
            moment = dt.datetime.fromisoformat(text)
        except ValueError:
            raise InputError(
                f"step {text!r}: give a date (2012-03-04), a decimal year (2012.17), or the time since the first sample"
                " (120d, 3.5yr)"
            ) from None
        if moment.tzinfo is None:
            moment = moment.replace(tzinfo=dt.UTC)
        date = moment.timestamp()
    if epoch is None:
        raise InputError(
            f"step {text}: this log has no dates; give the time since the first sample (120d, 3.5yr)"
        )
    return date - epoch


def date_of(seconds: float, epoch: float | None) -> str:
    """ISO date of a time in s since the first sample, such as ``2012-03-04``, with the time of day unless midnight.

    Without `epoch` (time of the first sample, s since 1970), the number of days, such as ``12 d``.
    """
    if epoch is None or not math.isfinite(epoch):
        return f"{seconds / 86400.0:.6g} d"
    whole = np.datetime64(round(epoch + seconds), "s")
    text = str(whole)
    return text[:10] if text.endswith("T00:00:00") else text

"""Base class of effects that change the level of the white noise over time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from allanite.common.former import Former
from allanite.effects._declared import Array, Columns, Parameter
from allanite.effects._modifier import Modifier
from allanite.effects.terms import Term, White

#: Parameters of one interval with another noise level.
INTERVAL = (
    Parameter("start", "s", "first time of the interval", "time"),
    Parameter("end", "s", "last time of the interval", "time"),
    Parameter("factor", "1", "standard deviation inside over outside", "time", low=1e-6),
)


#: Times of level changes, s, and the factor on the standard deviation after each; before the first time the factor is 1.
Switches = tuple[tuple[float, ...], tuple[float, ...]]


def interval_switches(when: tuple[float, float] | None, factor: float | None) -> Switches:
    """Pair (times, factors): (start, end) of the interval `when`, s, and (`factor`, 1), the factors from these times.

    An end before the start is replaced by the start, and a `factor` of None or 0 by 1. Both tuples are empty if `when`
    is None.
    """
    return ((), ()) if when is None else ((when[0], max(when)), (factor or 1.0, 1.0))


def mean_power(switches: Switches, start: ArrayLike, end: ArrayLike) -> Array:
    """Mean squared factor on the noise from each `start` to each `end` (ascending), s; NaN if both are equal.

    `switches` are the times of the level changes, s, and the factor after each; before the first time it is 1.
    """
    both = np.broadcast_arrays(np.asarray(start, dtype=float), np.asarray(end, dtype=float))
    low, high = (one.ravel() for one in both)
    total = np.where(low == high, np.nan, 1.0)
    times, factors = switches
    for (since, until), factor in zip(pairwise((*times, np.inf)), factors, strict=True):
        own = slice(np.searchsorted(high, since, side="right"), np.searchsorted(low, until))
        inside = np.minimum(high[own], until) - np.maximum(low[own], since)
        total[own] += (factor**2 - 1.0) * inside / (high[own] - low[own])
    return total.reshape(both[0].shape)


def interval_errors(
    when: tuple[float, float] | None, factor: float | None, rate: float
) -> dict[str, float]:
    """Standard errors of ``start`` and ``end`` (s) and ``factor`` of an interval with another noise level.

    `rate` is the number of independent samples per second. With n samples in the interval, the error of the factor is
    factor·√(2.034/2n). Here 2.034 is 7.81/3.84, the ratio of the 95 % quantiles of χ²₃ and χ²₁, because three values
    are estimated instead of one. A boundary has the 95 % half-width 5.5/4D + 1 samples (Yao 1987, Ann. Statist. 15);
    the error is this half-width over 1.96. D = −ln ∫√(pq) compares the distributions p and q of a sample on both sides.
    """
    ratio, (start, end) = (factor or 1.0) ** 2, when or (0.0, 0.0)
    samples = max(1.0, (end - start) * rate)
    apart = max(0.5 * float(np.log((1.0 + ratio) / (2.0 * np.sqrt(ratio)))), 1e-12)
    boundary = (5.5 / (4.0 * apart) + 1.0) / 1.96 / max(rate, 1e-300)
    return {"start": boundary, "end": boundary, "factor": np.sqrt(2.034 * ratio / (2.0 * samples))}


@dataclass(frozen=True)
class Level(Modifier):
    """White noise whose level changes over time; the spectrum of a record contains the mean power.

    Subclasses define `switches`, or `gain` and `mean_power`.
    """

    screened = "level"
    family = "level"
    changes_level = True

    switched = Former(
        "from_values", lambda cls, times, factors: cls.from_values(times=times, factors=factors)
    )
    gated = Former(
        "from_values",
        lambda cls, period, start, share, factor: cls.from_values(
            period=period, start=start, share=share, factor=factor
        ),
    )

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """White noise of variance `white` times the mean power over `span` (first, last time, s), if given."""
        return (White(white if span is None else white * _mean_power_of_record(self, span)),)

    def gain(self, time: Array, columns: Columns | None = None) -> Array:
        """Array of the factor on the noise at each `time` (s), shape (n,); 1 before the first level change."""
        times, factors = self.switches
        return np.array([1.0, *factors])[np.searchsorted(np.array(times), time, side="right")]

    def mean_power(self, start: ArrayLike, end: ArrayLike, columns: Columns | None = None) -> Array:
        """Array of the mean squared factor on the noise from each `start` to each `end`, s; NaN if both are equal."""
        return mean_power(self.switches, start, end)


@lru_cache(maxsize=64)
def _mean_power_of_record(level: Level, span: tuple[float, float]) -> float:
    """Mean squared factor of a level change over the `span` (s); cached, because every column of white noise needs it."""
    return float(level.mean_power(*span))

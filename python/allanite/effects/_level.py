"""Base class of effects that change the level of the white noise over time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from allanite.common.former import Former
from allanite.effects._declared import Array, Parameter
from allanite.effects._modifier import Modifier
from allanite.effects.terms import Term, White

#: Parameters of one interval with another noise level.
INTERVAL = (
    Parameter("start", "s", "first time of the interval", "time"),
    Parameter("end", "s", "last time of the interval", "time"),
    Parameter("factor", "1", "standard deviation inside over outside", "time", low=1e-6),
)


def interval_power(
    start: ArrayLike, end: ArrayLike, when: tuple[float, float] | None, factor: float | None
) -> Array:
    """Array of the mean noise power of time segments relative to the power outside the interval `when`.

    It is 1 + (factor² − 1) times the fraction of the segment inside the interval, and 1 if `when` or `factor` is None.
    Segments run from `start` to `end`, s.
    """
    low, high = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    if when is None or factor is None:
        return np.ones(low.shape)
    inside = np.clip(np.minimum(high, when[1]) - np.maximum(low, when[0]), 0.0, None)
    return np.asarray(1.0 + (factor**2 - 1.0) * inside / (high - low))


def interval_errors(
    when: tuple[float, float] | None, factor: float | None, rate: float
) -> dict[str, float]:
    """Dict of the standard errors of ``start`` and ``end`` (s) and ``factor`` of an interval with another noise level.

    `rate` is the number of independent samples per second. A level from n samples has a relative standard error of
    1/√(2n). It is widened by √(7.81/3.84), because the boundaries are estimated too (joint 95 % region of three values
    instead of one). The error of a boundary is that of the highest point of two random walks of logL that fall to both
    sides. For a small change, 95 % of the errors are within 5.5 units of expected logL (Yao 1987, Ann. Statist. 15).
    One sample contributes four times D = −ln ∫√(pq), with p and q the distributions of a sample on both sides. For a
    large change the walk on the louder side has rare long steps, and D still determines the error: 5.5/4D samples, plus
    the sample that contains the boundary.
    """
    ratio, (start, end) = (factor or 1.0) ** 2, when or (0.0, 0.0)
    samples = max(1.0, (end - start) * rate)
    apart = max(0.5 * float(np.log((1.0 + ratio) / (2.0 * np.sqrt(ratio)))), 1e-12)
    boundary = (5.5 / (4.0 * apart) + 1.0) / 1.96 / max(rate, 1e-300)
    return {"start": boundary, "end": boundary, "factor": np.sqrt(2.034 * ratio / (2.0 * samples))}


@dataclass(frozen=True)
class Level(Modifier):
    """White noise whose level changes over time; the spectrum of a record contains the mean power."""

    screened = "level"
    family = "level"
    passing = True

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
        """Tuple with one term: white noise of variance `white` times the mean power over `span` (first, last time, s).

        Without `span` the variance is unchanged.
        """
        return (White(white if span is None else white * _mean_power(self, span)),)


@lru_cache(maxsize=64)
def _mean_power(level: Level, span: tuple[float, float]) -> float:
    """Mean of the squared factor of a level change over the `span` (first, last time, s) of a record.

    Cached, because every column of white noise needs it.
    """
    return float(level.mean_power(*span))

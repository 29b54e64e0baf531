"""What changes the level of the white noise over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.effects._base import Parameter
from allanite.effects._modifier import Modifier
from allanite.effects.terms import Term, White

__all__ = ["INTERVAL", "Level", "interval_errors", "interval_power"]

#: What one interval is.
INTERVAL = (
    Parameter("start", "s", "first time of the interval", "time"),
    Parameter("end", "s", "last time of the interval", "time"),
    Parameter("factor", "1", "standard deviation inside over outside", "time", low=1e-6),
)


def interval_power(
    start: ArrayLike, end: ArrayLike, when: tuple[float, float] | None, factor: float | None
) -> NDArray[np.float64]:
    """Mean power of stretches over that outside of the interval `when`: 1 + (factor² − 1) times their part inside of it."""
    low, high = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    if when is None or factor is None:
        return np.ones(low.shape)
    inside = np.clip(np.minimum(high, when[1]) - np.maximum(low, when[0]), 0.0, None)
    return np.asarray(1.0 + (factor**2 - 1.0) * inside / (high - low))


def interval_errors(
    when: tuple[float, float] | None, factor: float | None, rate: float
) -> dict[str, float]:
    """Standard errors of the three values, for so many independent samples a second.

    A level from n samples is known to 1/√(2n), times √(7.81/3.84) as the boundaries were chosen with it (the joint 95 %
    region of three values against that of one). The error of a boundary is that of the highest point of two random walks
    of logL that fall to both sides. Of a small change 95 % of it are within 5.5 units of expected logL (Yao 1987, Ann.
    Statist. 15), a sample of which is four times D = −ln ∫√(pq), p and q the laws of a sample on the two sides. Of a large
    one the walk on the louder side has rare long steps, and it is D that says how far the boundary goes: 5.5/4D samples,
    and a sample in which it lies.
    """
    ratio, (start, end) = (factor or 1.0) ** 2, when or (0.0, 0.0)
    samples = max(1.0, (end - start) * rate)
    apart = max(0.5 * float(np.log((1.0 + ratio) / (2.0 * np.sqrt(ratio)))), 1e-12)
    boundary = (5.5 / (4.0 * apart) + 1.0) / 1.96 / max(rate, 1e-300)
    return {
        "start": boundary,
        "end": boundary,
        "factor": np.sqrt(2.034 * ratio / (2.0 * samples)),
    }


@dataclass(frozen=True)
class Level(Modifier):
    """White noise that is louder at some times than at others; the spectrum of a record sees the mean power.

    Examples
    --------
    How a check of levels makes such an effect of what it found:

    >>> al.effects.NoiseLevels.switched((5.0, 9.0), (2.0, 1.0)).switching_at((5.5, 9.0), (2.0, 1.0)).switches
    ((5.5, 9.0), (2.0, 1.0))
    >>> al.effects.PeriodicNoiseLevel.gated(60.0, 12.0, 0.25, 2.0).share
    0.25
    >>> louder = al.effects.NoiseOfColumn(column="temp").following(np.linspace(10.0, 30.0, 5), 0.02)
    >>> round(louder.reference, 2), al.effects.NoiseLevels.gated(60.0, 12.0, 0.25, 2.0)
    (20.99, None)
    """

    screened: ClassVar[str] = "level"
    family: ClassVar[str] = "level"
    passing: ClassVar[bool] = True

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """The mean power over the record (`span`: its first and last time in s)."""
        return (White(white if span is None else white * float(self.mean_power(*span))),)

    @classmethod
    def switched(cls, times: tuple[float, ...], factors: tuple[float, ...]) -> Self | None:
        """The effect where the level changes at `times` (s), to these `factors` of that at the start; by default None."""
        return None

    @classmethod
    def gated(cls, period: float, start: float, share: float, factor: float) -> Self | None:
        """The effect where a `share` of each `period` from `start` on (s) has `factor` times the level; by default None."""
        return None

    def following(self, values: NDArray[np.float64], coefficient: float) -> Self | None:
        """The effect where ln of the level is a line of slope `coefficient` over a column's `values`; by default None."""
        return None

    @property
    def switches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times of its changes, s, and the factors from each on; by default none."""
        return (), ()

    def switching_at(self, times: tuple[float, ...], factors: tuple[float, ...]) -> Self:
        """The same with other `times` of its changes, s, and other `factors` from each on."""
        return self

"""What changes the white part of a model, or takes samples out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.effects._base import Effect
from allanite.effects.terms import Term, White

if TYPE_CHECKING:
    from allanite.effects.model import Model

__all__ = ["Modifier"]


@dataclass(frozen=True)
class Modifier(Effect):
    """Changes the white part of the model instead of adding a process.

    Examples
    --------
    >>> louder = al.effects.NoiseLevelChange(start=50.0, end=100.0, factor=2.0)
    >>> louder.gain(np.array([10.0, 60.0])), float(louder.mean_power(0.0, 100.0))
    (array([1., 2.]), 2.5)
    >>> louder.missing(2, 10.0), louder.generators(1.0, 10.0), louder.whole
    (array([False, False]), None, None)
    >>> al.effects.NoiseLevelChange.during(50.0, 100.0, 2.0) == louder, al.effects.NoiseLevelChange.at([1.0])
    (True, None)
    >>> al.effects.Outliers.at([1.0, 7.0]).moments
    (1.0, 7.0)
    >>> fan = al.effects.BandLevelChange.changing((2.0, 4.0), (50.0, 100.0), 3.0)
    >>> fan.band, fan.power_between(50.0, 100.0, (0.0, 100.0)), louder.band
    ((2.0, 4.0), array(1.8), None)
    >>> near, far = (al.effects.Resonance(frequency=f, damping=0.01) for f in (3.0, 5.0))
    >>> fan.swells(near), fan.swells(far)
    (True, False)
    >>> louder.modify(1.0, 10.0, (0.0, 100.0))  # white noise of variance 1 over the whole record
    (White(variance=2.5),)
    """

    #: Whether it acts at times of its own, and on the spectrum by its mean over the record.
    passing: ClassVar[bool] = False
    #: Whether it takes samples out of the record (`missing`).
    removes: ClassVar[bool] = False

    @classmethod
    def candidates(
        cls, model: Model, columns: Mapping[str, NDArray[np.float64]]
    ) -> tuple[Self, ...]:
        """None where the `model` has no white part to change."""
        return super().candidates(model, columns) if model.white is not None else ()

    @classmethod
    def at(cls, times: Sequence[float]) -> Self | None:
        """The effect at samples that stand out at these `times`, s, where a check looks for those; by default None."""
        return None

    @classmethod
    def during(cls, start: float, end: float, factor: float) -> Self | None:
        """The effect where the white level is `factor` times the rest from `start` to `end`, s; by default None."""
        return None

    @classmethod
    def changing(
        cls, band: tuple[float, float], when: tuple[float, float], factor: float
    ) -> Self | None:
        """The effect where a `band` (Hz) is `factor` times as strong over an interval `when` (s); by default None."""
        return None

    @property
    def band(self) -> tuple[float, float] | None:
        """Lowest and highest frequency (Hz) of noise whose `power_between` times changes; by default None."""
        return None

    def swells(self, effect: Effect) -> bool:
        """Whether that noise is of an `effect`: a random process that has the middle of its band there."""
        if self.band is None or effect.occupies is None or isinstance(effect, Modifier):
            return False
        return self.band[0] <= 0.5 * sum(effect.occupies) <= self.band[1]

    def power_between(
        self,
        start: NDArray[np.float64] | float,
        end: NDArray[np.float64] | float,
        span: tuple[float, float],
    ) -> NDArray[np.float64]:
        """Power of its `band` from each `start` to each `end` over that of the whole `span`, s."""
        return np.ones(np.shape(start))

    @property
    def whole(self) -> Modifier | None:
        """The filter that all random processes pass; by default None: the white part alone is changed."""
        return None

    @property
    def moments(self) -> tuple[float, ...]:
        """Times of the single samples that it names, s; by default none."""
        return ()

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Terms that stand for white noise of variance `white` a sample once the effect acts on it; by default itself.

        `rate` is in Hz; `span` is the first and last time of the record in s, where that matters.
        """
        return (White(white),)

    def generators(self, white: float, rate: float) -> list[tuple[str, list[float]]] | None:
        """The core's generators of noise of variance `white` a sample at `rate` Hz once the effect acts on it.

        By default None: the terms suffice.
        """
        return None

    def gain(
        self, time: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]] | None = None
    ) -> NDArray[np.float64]:
        """By what the white samples at each `time` (s) are multiplied, where it is `passing`.

        `columns` are the other columns of the recording at these times.
        """
        return np.ones(time.shape)

    def mean_power(
        self,
        start: ArrayLike,
        end: ArrayLike,
        columns: Mapping[str, NDArray[np.float64]] | None = None,
    ) -> NDArray[np.float64]:
        """Mean of the squared `gain` from each `start` to each `end`, s, where other `columns` have these means."""
        return np.ones(np.shape(start))

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Mask of the n samples at `rate` Hz that it takes out."""
        return np.zeros(n, dtype=bool)

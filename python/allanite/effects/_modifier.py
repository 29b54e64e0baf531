"""Base class of effects that change the white noise of a model, filter all noise, or exclude samples."""

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


@dataclass(frozen=True)
class Modifier(Effect):
    """An effect that changes the noise of a model, or excludes samples, instead of adding a process.

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

    #: True if the noise level changes over time; the spectrum then contains the mean over the record.
    passing: ClassVar[bool] = False
    #: True if the effect excludes samples of the record (`missing`).
    removes: ClassVar[bool] = False

    @classmethod
    def candidates(
        cls, model: Model, columns: Mapping[str, NDArray[np.float64]]
    ) -> tuple[Self, ...]:
        """Effects of this kind to try; none if the `model` has no white noise."""
        return super().candidates(model, columns) if model.white is not None else ()

    @classmethod
    def at(cls, times: Sequence[float]) -> Self | None:
        """The effect that excludes single outlying samples at `times`, s; by default None."""
        return None

    @classmethod
    def during(cls, start: float, end: float, factor: float) -> Self | None:
        """The effect that multiplies the white-noise level by `factor` from `start` to `end` (s); by default None."""
        return None

    @classmethod
    def changing(
        cls, band: tuple[float, float], when: tuple[float, float], factor: float
    ) -> Self | None:
        """The effect that multiplies the noise in a `band` (Hz) by `factor` in the interval `when` (s); by default None."""
        return None

    @property
    def band(self) -> tuple[float, float] | None:
        """Pair: lowest and highest frequency, Hz, of the noise whose power changes over time; by default None."""
        return None

    def swells(self, effect: Effect) -> bool:
        """True if the `band` of this modifier includes the center of the band of `effect`; False if either has no band."""
        if self.band is None or effect.occupies is None or isinstance(effect, Modifier):
            return False
        return self.band[0] <= 0.5 * sum(effect.occupies) <= self.band[1]

    def power_between(
        self,
        start: NDArray[np.float64] | float,
        end: NDArray[np.float64] | float,
        span: tuple[float, float],
    ) -> NDArray[np.float64]:
        """Mean power of the `band` from each `start` to each `end` relative to that over the `span`, times in s."""
        return np.ones(np.shape(start))

    @property
    def whole(self) -> Modifier | None:
        """`Modifier`: filter that acts on all random processes; by default None: only the white noise is changed."""
        return None

    @property
    def moments(self) -> tuple[float, ...]:
        """Tuple of floats: times of the samples that the effect excludes or marks, s; by default none."""
        return ()

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Terms of white noise of variance `white` per sample after the effect acts on it; by default unchanged.

        `rate` is in Hz; `span` is the first and last time of the record, s.
        """
        return (White(white),)

    def generators(self, white: float, rate: float) -> list[tuple[str, list[float]]] | None:
        """Generators, in the compiled core, of white noise of variance `white` at `rate` Hz after the effect acts on it.

        By default None: the terms are simulated.
        """
        return None

    def gain(
        self, time: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]] | None = None
    ) -> NDArray[np.float64]:
        """Factor on the white-noise samples at each `time` (s), shape (n,).

        The factor is 1 at all times unless the effect changes the noise level (`passing`). `columns` are the
        logged columns of the recording at these times.
        """
        return np.ones(time.shape)

    def mean_power(
        self,
        start: ArrayLike,
        end: ArrayLike,
        columns: Mapping[str, NDArray[np.float64]] | None = None,
    ) -> NDArray[np.float64]:
        """Mean of the squared `gain` from each `start` to each `end`, s; `columns` are means of logged columns there."""
        return np.ones(np.shape(start))

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Mask of n samples at `rate` Hz: True for samples that the effect excludes."""
        return np.zeros(n, dtype=bool)

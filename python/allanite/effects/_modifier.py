"""Base class of effects that change the white noise of a model, filter all noise, or exclude samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.former import Former
from allanite.effects._base import Effect
from allanite.effects._declared import Array, Columns
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
    >>> al.effects.Outliers(count=2, times=(1.0, 7.0)).moments
    (1.0, 7.0)
    >>> fan = al.effects.BandLevelChange(low=2.0, high=4.0, start=50.0, end=100.0, factor=3.0)
    >>> fan.band, fan.power_between(50.0, 100.0, (0.0, 100.0)), louder.band
    ((2.0, 4.0), array(1.8), None)
    >>> near, far = (al.effects.Resonance(frequency=f, damping=0.01) for f in (3.0, 5.0))
    >>> fan.changes_level_of(near), fan.changes_level_of(far)
    (True, False)
    >>> al.effects.NoiseLevels(times=(5.0, 9.0), factors=(2.0, 1.0)).switching_at((5.5, 9.0), (2.0, 1.0)).switches
    ((5.5, 9.0), (2.0, 1.0))
    >>> warmer = al.effects.NoiseOfColumn(column="temp").following(np.linspace(10.0, 30.0, 5), 0.02)
    >>> round(warmer.reference, 2)
    20.99
    >>> louder.modify(1.0, 10.0, (0.0, 100.0))  # white noise of variance 1 over the whole record
    (White(variance=2.5),)
    """

    at = Former(
        "from_values", lambda cls, times: cls.from_values(count=len(times), times=tuple(times))
    )
    changing = Former(
        "from_values",
        lambda cls, band, when, factor: cls.from_values(
            low=band[0], high=band[1], start=when[0], end=when[1], factor=factor
        ),
    )
    # A disturbance has no factor.
    during = Former(
        "from_values",
        lambda cls, start, end, factor: (
            cls.from_values(start=start, end=end, factor=factor)
            or cls.from_values(start=start, end=end)
        ),
    )

    @classmethod
    def candidates(cls, model: Model, columns: Columns) -> tuple[Self, ...]:
        """Effects that a check tries to add; empty if the `model` has no white noise, unless samples are excluded."""
        if model.white is None and not cls.removes:
            return ()
        return super().candidates(model, columns)

    @property
    def band(self) -> tuple[float, float] | None:
        """Pair (lowest, highest) frequency, Hz, of the noise whose power changes over time; by default None."""
        return None

    swells = Former("changes_level_of")

    def changes_level_of(self, effect: Effect) -> bool:
        """True if the `band` of this modifier includes the center of the band of `effect`, which is no modifier."""
        if self.band is None or effect.occupies is None or isinstance(effect, Modifier):
            return False
        return self.band[0] <= 0.5 * sum(effect.occupies) <= self.band[1]

    def power_between(
        self, start: Array | float, end: Array | float, span: tuple[float, float]
    ) -> Array:
        """Array of the mean power in the changed frequency `band` from each `start` to each `end`, shape of `start`.

        The power is relative to the mean power over `span`, the first and last time of the record. Times are in s from the
        first sample. By default all values are 1.
        """
        return np.ones(np.shape(start))

    def following(self, values: Array, coefficient: float) -> Self | None:
        """Copy in which ln(noise level) is linear in the `values` of a column with slope `coefficient`.

        None (default) if effects of this kind do not follow a column.
        """
        return None

    @property
    def switches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times of the level changes, s, and the factors after each; by default both are empty."""
        return (), ()

    def switching_at(self, times: tuple[float, ...], factors: tuple[float, ...]) -> Self:
        """Copy with level changes at other `times`, s, and other `factors` after each; itself without `switches`."""
        return self

    @property
    def whole(self) -> Modifier | None:
        """The filter, if this effect filters all random processes; None if it only changes the white noise (default)."""
        return None

    @property
    def moments(self) -> tuple[float, ...]:
        """Tuple of the times of the samples that the effect excludes or marks, s; by default empty."""
        return ()

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Tuple of the terms of white noise of variance `white` per sample after the effect; by default `White(white)`.

        `rate` is in Hz; `span` is the first and last time of the record, s.
        """
        return (White(white),)

    def generators(self, white: float, rate: float) -> list[tuple[str, list[float]]] | None:
        """List of (name, parameters) of generators in the compiled core that simulate the white noise after this effect.

        By default None: the noise is simulated from its spectral terms. `white` is the variance per sample before the
        effect, `rate` the sampling rate, Hz.
        """
        return None

    def gain(self, time: Array, columns: Columns | None = None) -> Array:
        """Array of the factor on the white-noise samples at each `time` (s), shape (n,); by default ones.

        Effects that change the noise level over time (`changes_level`) override it. `columns` are the logged columns of the
        recording at these times.
        """
        return np.ones(time.shape)

    def mean_power(self, start: ArrayLike, end: ArrayLike, columns: Columns | None = None) -> Array:
        """Array of the mean squared `gain` in time segments from each `start` to each `end`, s; by default ones.

        `columns` are the means of the logged columns in these segments, by name.
        """
        return np.ones(np.shape(start))

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Boolean mask of n samples at `rate` Hz: True for samples that the effect excludes; by default all False."""
        return np.zeros(n, dtype=bool)

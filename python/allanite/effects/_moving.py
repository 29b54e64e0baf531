"""Bands whose middle moves: at one place after the other, each for an equal part of the record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Effect, Stochastic

__all__ = ["Moving", "weights"]


@dataclass(frozen=True)
class Moving(Stochastic):
    """A random process that is another one in each part of the record, and passes from one to the next.

    Examples
    --------
    >>> fan = al.effects.DriftingResonance.along(al.effects.Resonance(frequency=10.0, damping=0.02, rms=0.1), (11.0, 10.0))
    >>> fan.middles
    (11.0, 10.0)
    >>> print(fan.stretches[0], al.effects.DriftingResonance.along(al.GaussMarkov(), (11.0, 10.0)))
    RES(frequency=11, damping=0.02, rms=0.1) None
    """

    screened: ClassVar[str] = "moving band"
    family: ClassVar[str] = "course"

    @property
    def stretches(self) -> tuple[Stochastic, ...]:
        """What it is in each part of the record, in turn."""
        raise NotImplementedError

    @property
    def middles(self) -> tuple[float, ...]:
        """Where its band is in each part of the record, in turn, Hz."""
        raise NotImplementedError

    @classmethod
    def along(cls, band: Effect, course: Sequence[float]) -> Self | None:
        """A `band` with its middle at the frequencies of `course`, Hz, in turn; by default None: it is no such form."""
        return None


def weights(
    time: NDArray[np.float64], span: tuple[float, float], parts: int
) -> NDArray[np.float64]:
    """Share of each part of a record of `span` s in the power at some times, shape (parts, times): 1 together.

    All of it in the middle of a part, linear from one to the next.
    """
    start, end = span
    at = np.clip((time - start) / (end - start) * parts - 0.5, 0.0, parts - 1.0)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(at - np.arange(parts)[:, None])))

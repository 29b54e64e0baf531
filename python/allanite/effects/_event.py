"""What happens to the bias at one time: known functions of time with one height."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._known import Deterministic

__all__ = ["Away", "Event", "cosines", "sines"]

#: Ordinates of which one sine each is enough: the square root of those that a search asks for. Of fewer sines than so many
#: each is computed.
WIDE, MANY = 64, 2048


@dataclass(frozen=True)
class Event(Deterministic):
    """A change of the bias of a height that is fitted."""

    happens_once: ClassVar[bool] = True

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → samples: those of a time need no others."""
        return self._pointwise(rate, covariates)

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """The height."""
        return self.with_values(height=float(amplitudes[0]))

    def amplitudes(self) -> NDArray[np.float64]:
        """(height,)."""
        return np.array([self.values["height"] or 0.0])

    def _edge_error(self, density: float) -> float:
        """Standard error of the time of an edge, s, in noise of this density: a jump h is placed to ±11 S/h² (95 %).

        The limit law of a change point (Yao 1987) is not normal; the number given is its 95 % width over 1.96.
        """
        return 5.6 * density / max((self.values["height"] or 0.0) ** 2, 1e-300)


@dataclass(frozen=True)
class Away(Event):
    """The bias leaves its level and comes back, once or several times.

    Examples
    --------
    >>> once = al.effects.Excursion(start=20.0, end=60.0, height=0.2)
    >>> twice = al.effects.Excursions.together([al.effects.Excursion(start=80.0, end=90.0, height=-0.1), once])
    >>> [e.start for e in twice.singly], once.singly == (once,), al.effects.Excursion.together([once])
    ([20.0, 80.0], True, None)
    """

    family: ClassVar[str] = "event"

    @property
    def singly(self) -> tuple[Away, ...]:
        """Each time by itself, with its height, first to last."""
        return (self,)

    @classmethod
    def together(cls, events: Sequence[Away]) -> Self | None:
        """The effect that is all of these `events`; by default None: it is one."""
        return None


def sines(k: NDArray[np.float64], j: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    """sin(πjk/n) of many k in the ordinates j, shape (k, j).

    Of consecutive ordinates by sin(a + b), one of `WIDE` and one within: a search asks for millions.
    """
    return _waves(k, j, n, 0.0)


def cosines(k: NDArray[np.float64], j: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    """cos(πjk/n), as `sines`."""
    return _waves(k, j, n, 0.5 * np.pi)


def _waves(
    k: NDArray[np.float64], j: NDArray[np.int64], n: int, phase: float
) -> NDArray[np.float64]:
    """sin(πjk/n + phase), shape (k, j)."""
    if k.size * j.size < MANY or j[-1] - j[0] + 1 != j.size:
        return np.asarray(np.sin(np.pi * j * k[:, None] / n + phase))
    turn = np.pi / n * k[:, None]
    coarse = turn * (j[0] + WIDE * np.arange(-(-j.size // WIDE))) + phase
    fine = turn * np.arange(WIDE)
    left = np.stack([np.sin(coarse), np.cos(coarse)], axis=-1)
    right = np.stack([np.cos(fine), np.sin(fine)], axis=-2)
    return np.asarray((left @ right).reshape(k.size, -1)[:, : j.size])

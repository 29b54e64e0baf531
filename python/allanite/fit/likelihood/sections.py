"""Power in cells of frequency and equal sections of a record: where a band is at which time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.showing import brief
from allanite.fit.likelihood.expected import density

if TYPE_CHECKING:
    from allanite.effects.terms import Term

__all__ = ["Cells", "Sections", "SectionsOfSamples"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Mean squares of the ordinates in cells, U² per sample.

    Attributes
    ----------
    power, count : ndarray, shape (sections, cells)
        And how many ordinates each is the mean of.
    at : tuple of (ndarray of int64, int)
        Middle ordinates of the cells, and of how many samples these are the ordinates: of some cells, then of others.
    """

    power: Array
    count: Array
    at: tuple[tuple[NDArray[np.int64], int], ...]

    __repr__ = brief

    def expected(self, terms: tuple[Term, ...]) -> Array:
        """What terms make of each cell, shape (cells,)."""
        if not terms:
            return np.zeros(self.power.shape[1])
        return np.concatenate([density(terms, j, n) for j, n in self.at])

    def log_likelihood(self, expected: Array) -> Array:
        """Of the cells of each section, shape (sections,), where so much is expected at all times."""
        judged = np.log(expected) + self.power / expected
        return np.asarray(-0.5 * np.einsum("sc,sc->s", judged, self.count))


class Sections(Protocol):
    """Equal sections of a record, and the frequencies between which they tell anything, Hz."""

    limits: tuple[float, float]

    def cells(self, within: tuple[float, float], step: float) -> Cells:
        """Cells of about a `step` between two frequencies, Hz."""


class SectionsOfSamples:
    """Sections of samples, of which some at the end are left out."""

    def __init__(self, samples: Array, rate: float, number: int) -> None:
        self.rate, self.limits = rate, (0.0, 0.5 * rate)
        self.n = samples.size // number
        pieces = samples[: number * self.n].reshape(number, self.n)
        self.squares = np.array([_kernels.cosine_transform(piece) ** 2 for piece in pieces])

    def cells(self, within: tuple[float, float], step: float) -> Cells:
        """Cells of about a `step` between two frequencies, Hz."""
        first, last = max(within[0], step), min(within[1], 0.5 * self.rate)
        places = np.round(np.arange(first, last, step) * 2.0 * self.n / self.rate)
        edges: NDArray[np.int64] = np.unique(places.astype(np.int64).clip(1, self.n))
        count = np.diff(edges)
        power = np.add.reduceat(self.squares[:, : edges[-1]], edges[:-1], axis=1) / count
        middles = np.asarray((edges[:-1] + edges[1:] - 1) // 2, dtype=np.int64)
        return Cells(power, np.broadcast_to(count, power.shape), ((middles, self.n),))

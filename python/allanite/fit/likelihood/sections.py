"""Spectrogram of a record: power in frequency cells of equal time sections, to follow bands that move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.effects.terms import Term
from allanite.fit.likelihood.expected import density


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Mean squared ordinates, U² per sample, in frequency cells of each section, and their number, shape (sections, cells).

    `at` are groups of cells in order: the middle ordinates of the cells, and the number of samples whose transform these
    ordinates belong to.
    """

    power: Array
    count: Array
    at: tuple[tuple[NDArray[np.int64], int], ...]

    __repr__ = brief

    def expected(self, terms: tuple[Term, ...]) -> Array:
        """Array of the expected power of each frequency cell from spectral terms, shape (cells,); zeros without terms."""
        if not terms:
            return np.zeros(self.power.shape[1])
        return np.concatenate([density(terms, j, n) for j, n in self.at])

    def log_likelihood(self, expected: Array) -> Array:
        """Whittle logL of each time section, shape (sections,), for this expected power of each frequency cell."""
        # A model without power in a cell has a logL far below that of any other, but a finite one.
        if (expected < 1e-30 * self.power.max(axis=0)).any():
            expected = np.maximum(expected, 1e-30 * self.power)
        judged = np.log(expected) + self.power / expected
        return np.asarray(-0.5 * np.einsum("sc,sc->s", judged, self.count))


class Sections:
    """`number` equal sections of samples; samples that do not fill a section at the end are excluded.

    `limits` are the lowest and highest frequency with power, Hz.
    """

    def __init__(self, samples: Array, rate: float, number: int) -> None:
        self.rate, self.limits = rate, (0.0, 0.5 * rate)
        self.n = samples.size // number
        pieces = samples[: number * self.n].reshape(number, self.n)
        self.squares = np.array([_kernels.cosine_transform(piece) ** 2 for piece in pieces])

    def cells(self, within: tuple[float, float], step: float) -> Cells:
        """`Cells`: power of each section in frequency cells about `step` Hz wide, between the two `within`, Hz."""
        first, last = max(within[0], step), min(within[1], 0.5 * self.rate)
        places = np.round(np.arange(first, last, step) * 2.0 * self.n / self.rate)
        edges: NDArray[np.int64] = np.unique(places.astype(np.int64).clip(1, self.n))
        count = np.diff(edges)
        power = np.add.reduceat(self.squares[:, : edges[-1]], edges[:-1], axis=1) / count
        middles = np.asarray((edges[:-1] + edges[1:] - 1) // 2, dtype=np.int64)
        return Cells(power, np.broadcast_to(count, power.shape), ((middles, self.n),))

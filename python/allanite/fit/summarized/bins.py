"""Frequency bins of a summary: single ordinates at low frequencies, power of segments above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.spectrum import Bins
from allanite.summary.lapped import LOW, SEGMENT
from allanite.summary.lines import without_lines

if TYPE_CHECKING:
    from allanite.summary.ends import Reading

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SummaryBins(Bins):
    """Bins of the summarized record: the lowest contain single ordinates, the others the power of segments.

    Attributes
    ----------
    known : int
        Number of bins with single ordinates.
    folds : ndarray, shape (folds + 1, 2, bins − known)
        Number of ordinates and mean power of each other bin: first of all coefficients, then of each fold.
    """

    known: int
    folds: Array

    __repr__ = brief

    def power(self, ordinates: Array) -> Array:
        """Array of the mean power of each bin, shape (bins,).

        Low frequencies take it from the squared `ordinates`, higher ones from segments.
        """
        edges = self.edges[: self.known]
        low = np.add.reduceat(ordinates**2, edges) / self.count[: self.known]
        return np.concatenate([low, self.folds[0, 1]])

    def folded(self, ordinates: Array, folds: int) -> tuple[Array, Array]:
        """Pair (number, sum of squares) of the ordinates of each fold in each bin, two arrays of shape (folds, bins).

        Fold k, for cross-validation, has the single ordinates j, and the coefficients m of segments, with j or m modulo
        `folds` = k. `folds` must be 5.
        """
        edges, count = self.edges[: self.known + 1], self.count[: self.known]
        low = Bins(self.n, edges, count, self.nodes, self.owner, self.groups)
        number, total = low.folded(ordinates, folds)
        high = self.folds[1:]
        return np.hstack([number, high[:, 0]]), np.hstack([total, high[:, 0] * high[:, 1]])


def folds_of(reading: Reading, bins: Bins, known: int, folds: int = 5) -> Array:
    """Array of (number of ordinates, mean power) of each bin without single ordinates, shape (folds + 1, 2, bins − known).

    `known` is the number of bins with single ordinates. Entry 0 is of all coefficients of the segments' transforms. Entry
    k + 1 is of those with index modulo `folds` = k (a fold for cross-validation). Spectral lines are removed.
    """
    edges, power, place = [], [], []
    for level in reversed(range(len(reading.octaves))):
        found, _ = without_lines(reading, level, 1.0)
        m = np.arange(LOW, LOW + found.size)
        edges.append(m * (bins.n / (SEGMENT * 2.0**level)))
        power.append(found)
        place.append(m)
    j = np.append(np.concatenate(edges), float(bins.n))
    level_of, m = np.concatenate(power), np.concatenate(place)
    width = np.diff(j)
    wanted = bins.edges[known:] - 0.5
    out = np.empty((folds + 1, 2, wanted.size - 1))
    for fold in range(folds + 1):
        own = width * (1.0 if fold == 0 else m % folds == fold - 1)
        inside, total = (
            np.diff(np.interp(wanted, j, np.concatenate([[0.0], np.cumsum(v)])))
            for v in (own, own * level_of)
        )
        out[fold] = inside, total / np.maximum(inside, 1e-300)
    # The ends of the coefficient grid differ from those of the record by half an ordinate.
    count = np.diff(bins.edges[known:]).astype(float)
    out[0, 0] = count
    whole = out[1:, 0].sum(axis=0)
    out[1:, 0] *= count / np.maximum(whole, 1e-300)
    return out

"""The usual type of an array, runs in masks, and the inverse of a covariance matrix."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Array of doubles.
Array: TypeAlias = NDArray[np.float64]


def scaled_inverse(matrix: Array) -> Array:
    """Pseudoinverse of a positive semidefinite matrix, which is first scaled to a unit diagonal.

    The scale makes the result independent of the units of the rows. Eigenvalues below 1e-10 of the largest count as 0.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    sizes = np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(matrix / sizes, rcond=1e-10, hermitian=True) / sizes)


def medians(rows: Array) -> Array:
    """Array of the medians along the last axis. It sorts, which numpy does faster than its median of many rows."""
    rising = np.sort(rows, axis=-1)
    middle = rising.shape[-1] // 2
    if rising.shape[-1] % 2:
        return np.asarray(rising[..., middle])
    return np.asarray(0.5 * (rising[..., middle - 1] + rising[..., middle]))


def runs_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Tuple (first, end) of arrays, shape (runs,): the runs of True in a mask are ``mask[first:end]``."""
    padded = np.pad(mask, 1)
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return edges[::2], edges[1::2]


def run_at(mask: NDArray[np.bool_], index: int) -> tuple[int, int]:
    """Pair: first and last index of the run of True in a mask that contains `index`; mask[index] must be True."""
    first, end = runs_of(mask)
    run = int(np.searchsorted(first, index, side="right")) - 1
    return int(first[run]), int(end[run]) - 1

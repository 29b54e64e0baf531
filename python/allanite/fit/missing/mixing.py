"""Effect of missing samples on bin power: information left in each bin, and leakage between bins."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.memory import cleared_by_free_buffers

if TYPE_CHECKING:
    from allanite.spectrum import Bins

Mask = NDArray[np.bool_]


def _coupling(missing: Mask) -> Array:
    """Squared correlations that gaps cause between ordinates of white noise, in two terms, shape (2n,).

    The squared correlation of ordinates i and j is the sum of the elements at |i − j| and at i + j.
    """
    n = missing.size
    # Σ_k mask_k cos(πh(k+½)/n)/n; beyond n it repeats backwards with the opposite sign.
    transform = _kernels.cosine_transform(missing.astype(np.float64)) * np.sqrt(0.5 / n)
    transform[0] = 0.0
    return np.asarray(np.concatenate([transform, [0.0], transform[:0:-1]]) ** 2)


@cleared_by_free_buffers
@lru_cache(maxsize=4)
def _squared_correlations_cached(packed: bytes, n: int, edges: bytes) -> Array:
    """`squared_correlations`, cached for `packed`, the mask of n samples from `numpy.packbits`, and the int64 `edges`.

    Intervals of every fit of a search need them, and they take 0.2 s for a million samples.
    """
    missing = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=n).astype(bool)
    return squared_correlations(missing, np.frombuffer(edges, dtype=np.int64))


def squared_correlations(missing: Mask, edges: NDArray[np.int64]) -> Array:
    """Sum of the squared correlations that gaps cause between the ordinates of two bins, shape (bins, bins).

    The sum is over all pairs of one ordinate of each bin, for white noise. `edges` are the first ordinates of the bins and
    the end of the last.
    """
    squared = _coupling(missing)
    n = missing.size
    # With a double cumulative sum, the sum of a function of j − i or j + i over a rectangle takes four values.
    both = np.cumsum(np.cumsum(np.concatenate([squared[n - 1 : 0 : -1], squared])))

    def corner(at: NDArray[np.int64]) -> Array:
        """Double cumulative sum of the squared correlations at indices `at`; 0 before its start."""
        return np.where(at < 0, 0.0, both[np.maximum(at, 0)])

    low, high = edges[:-1], edges[1:]
    offset = n - 1  # `both` begins at j − i = −(n − 1)
    a, b, c, d = low[:, None], high[:, None], low[None], high[None]
    apart = corner(b - c + offset - 1) - corner(a - c + offset - 1)
    apart = apart - corner(b - d + offset - 1) + corner(a - d + offset - 1)
    total = corner(b + d - 2 + offset) - corner(a + d - 2 + offset)
    total = total - corner(b + c - 2 + offset) + corner(a + c - 2 + offset)
    return np.asarray(apart + total)


def known_ordinates(share: Array, bins: Bins) -> Array:
    """Effective number of ordinates in each bin that gaps leave known, Σ (1 − share), shape (bins,).

    The sum over all bins is the number of samples present, minus one for the mean.
    """
    return np.asarray(np.add.reduceat(1.0 - share, bins.edges[:-1]))


def mixing_of(missing: Mask, share: Array, bins: Bins) -> Array:
    """Change of the observed power of bin a (row) per change of true power of bin b (column), shape (bins, bins).

    Changes are relative, and each row sums to 1. r is the mean unknown share (`share`) of the ordinates of a bin. In row a,
    the diagonal gets 1 − r of bin a. All bins b divide the rest r in proportion to their weights. The weight of b is the
    mean of share·(1 − share) over b, times the sum of the squared correlations between the ordinates of a and b. The
    weights hold because the unknown part, divided by √S, is a projection.
    """
    number = np.diff(bins.edges).astype(float)
    unknown = np.add.reduceat(share, bins.edges[:-1]) / number
    source = np.add.reduceat(share * (1.0 - share), bins.edges[:-1]) / number
    edges = np.ascontiguousarray(bins.edges, dtype=np.int64)
    pairs = _squared_correlations_cached(
        np.packbits(missing).tobytes(), missing.size, edges.tobytes()
    )
    coupled = np.maximum(pairs, 0.0) * source
    total = coupled.sum(axis=1)
    out = coupled * (unknown / np.maximum(total, 1e-300))[:, None]
    at = np.arange(number.size)
    out[at, at] += np.where(total > 0.0, 1.0 - unknown, 1.0)
    return np.asarray(out)

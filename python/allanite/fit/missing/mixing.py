"""What holes do to the power of bins: how much is seen of each, and how they come to depend on each other."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import released

if TYPE_CHECKING:
    from allanite.spectrum import Bins

__all__ = ["mixing_of", "seen_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _coupling(missing: Mask) -> Array:
    """Squared correlation that the holes make between ordinates h apart, h = 0…2n−1; 0 of an ordinate with itself.

    The cosine transform of the mask itself: what is missing of white noise is the mask times the noise.
    """
    n = missing.size
    # Σ_k mask_k cos(πh(k+½)/n)/n; beyond n it repeats with the other sign and backwards.
    transform = _kernels.cosine_transform(missing.astype(np.float64)) * np.sqrt(0.5 / n)
    transform[0] = 0.0
    return np.asarray(np.concatenate([transform, [0.0], transform[:0:-1]]) ** 2)


@released
@lru_cache(maxsize=4)
def _pairs_of(packed: bytes, n: int, edges: bytes) -> Array:
    """`_pairs` of a mask of n samples, packed: the same for every model."""
    missing = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=n).astype(bool)
    return _pairs(missing, np.frombuffer(edges, dtype=np.int64))


def _pairs(missing: Mask, edges: NDArray[np.int64]) -> Array:
    """Σ over ordinates j, i of two bins of their squared correlation by the holes, shape (bins, bins)."""
    squared = _coupling(missing)
    n = missing.size
    # Twice summed, a sum over a rectangle of j − i or of j + i is four values.
    both = np.cumsum(np.cumsum(np.concatenate([squared[n - 1 : 0 : -1], squared])))

    def corner(at: NDArray[np.int64]) -> Array:
        return np.where(at < 0, 0.0, both[np.maximum(at, 0)])

    low, high = edges[:-1], edges[1:]
    offset = n - 1  # `both` begins at j − i = −(n − 1)
    a, b, c, d = low[:, None], high[:, None], low[None], high[None]
    apart = corner(b - c + offset - 1) - corner(a - c + offset - 1)
    apart = apart - corner(b - d + offset - 1) + corner(a - d + offset - 1)
    total = corner(b + d - 2 + offset) - corner(a + d - 2 + offset)
    total = total - corner(b + c - 2 + offset) + corner(a + c - 2 + offset)
    return np.asarray(apart + total)


def seen_of(share: Array, bins: Bins) -> Array:
    """Samples' worth of each bin; their sum is the number of samples that are there, without the mean."""
    return np.asarray(np.add.reduceat(1.0 - share, bins.edges[:-1]))


def mixing_of(missing: Mask, share: Array, bins: Bins) -> Array:
    """How the power that is seen in a bin (rows) changes with that of each, both relative; rows sum to 1.

    e over the root of S is a projection: with c its correlations, Σ_i c_ji² = c_jj = r_j, and the ordinates of m answer to
    S as (δ_ji − c_ji)²/(1 − r_j). What a hole takes from i it shows in j; where r_i is 0 it takes nothing, and where it
    is 1 there is nothing to show.
    """
    number = np.diff(bins.edges).astype(float)
    unknown = np.add.reduceat(share, bins.edges[:-1]) / number
    source = np.add.reduceat(share * (1.0 - share), bins.edges[:-1]) / number
    edges = np.ascontiguousarray(bins.edges, dtype=np.int64)
    pairs = _pairs_of(np.packbits(missing).tobytes(), missing.size, edges.tobytes())
    coupled = np.maximum(pairs, 0.0) * source
    total = coupled.sum(axis=1)
    out = coupled * (unknown / np.maximum(total, 1e-300))[:, None]
    at = np.arange(number.size)
    out[at, at] += np.where(total > 0.0, 1.0 - unknown, 1.0)
    return np.asarray(out)

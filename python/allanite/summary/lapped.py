"""Halving the rate, and the power of overlapping segments that share nothing.

Segments are transformed by a lapped orthogonal transform (Malvar 1990; Princen, Johnson & Bradley 1987) with a window of
Kaiser and Bessel: the coefficients of all segments are an orthonormal basis of the record, so that a band's power is
counted once and with all its degrees of freedom, and a line stays within a few coefficients.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels

__all__ = [
    "LOW",
    "REACH",
    "SEGMENT",
    "gain",
    "halved",
    "hard_block",
    "kernel",
    "regridded",
    "segments",
]

Array = NDArray[np.float64]
#: Samples of a segment, and the lowest coefficient that is looked at: below, the next level of the pyramid sees more.
SEGMENT, LOW = 8192, 2457
#: Samples to each side that a halved sample is made of.
REACH = 16
#: −100 dB and more beyond the pass band, and far from a line.
BETA, ALPHA = 10.06, 4.0


@lru_cache(maxsize=1)
def _taps() -> Array:
    """Weights of the pairs of samples about the middle of two, shape (REACH,)."""
    at = np.arange(REACH) + 0.5
    taps = 0.5 * np.sinc(at / 2.0) * np.i0(BETA * np.sqrt(1.0 - (at / REACH) ** 2))
    return np.asarray(0.5 * taps / taps.sum())


def gain(f: Array, halvings: int) -> Array:
    """What so many halvings leave of an amplitude at f, cycles per sample of the first level."""
    out, at = np.ones_like(f), np.arange(REACH) + 0.5
    for level in range(halvings):
        w = 2.0 * np.pi * f * 2.0**level
        out *= 2.0 * np.cos(np.multiply.outer(w, at)) @ _taps()
    return out


@lru_cache(maxsize=1)
def kernel() -> _kernels.Lapped:
    """The core's loops, with these weights."""
    return _kernels.Lapped(*_window(), _taps())


def halved(x: Array) -> Array:
    """Every second sample of a low-passed series, at the middle of two, without the first and last `REACH`/2.

    Elementwise sums in one order: a sample comes out the same whatever was computed with it.
    """
    return kernel().halved(np.ascontiguousarray(x))


@lru_cache(maxsize=1)
def _window() -> tuple[Array, Array]:
    """Window at ½, 1½, … samples after the border of two segments, and as far before it."""
    rise = np.cumsum(np.kaiser(SEGMENT + 1, np.pi * ALPHA))
    rise = np.sqrt(rise[:-1] / rise[-1])
    return rise[SEGMENT // 2 :], rise[: SEGMENT // 2][::-1].copy()


def _turned(zones: Array) -> tuple[Array, Array]:
    """What the segments before and after each border take of the zone about it, both from the border outwards."""
    half = SEGMENT // 2
    after, before = _window()
    left, right = zones[..., half - 1 :: -1], zones[..., half:]
    return after * left - before * right, after * right + before * left


def segments(x: Array) -> Array:
    """Coefficients of consecutive segments, shape (segments, SEGMENT); `x` has half a segment more at each end."""
    return kernel().segments(np.ascontiguousarray(x)).reshape(-1, SEGMENT)


def hard_block(x: Array, left: bool, right: bool) -> Array:
    """Coefficients of a segment of any length that ends with the record on one side or both.

    Parameters
    ----------
    x : ndarray
        The segment, with half of `SEGMENT` more on each side that has a neighbour.
    left, right : bool
        Whether the record ends there.
    """
    from scipy.fft import dct

    half = SEGMENT // 2
    # What is larger than the noise would leak through the hard edge.
    x = x - x.mean()
    block = x[0 if left else half : x.size if right else x.size - half].copy()
    if not left:
        block[:half] = _turned(x[:SEGMENT])[1]
    if not right:
        block[block.size - half :] = _turned(x[x.size - SEGMENT :])[0][::-1]
    return np.asarray(dct(block, type=4, norm="ortho"))


def regridded(power: Array) -> Array:
    """Power of a segment of another length on the grid of `SEGMENT` coefficients; the total is kept."""
    total = np.concatenate([[0.0], np.cumsum(power)])
    at = np.linspace(0.0, power.size, SEGMENT + 1)
    return np.diff(np.interp(at, np.arange(power.size + 1.0), total))

"""Sines and cosines of whole records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["waves"]

Array = NDArray[np.float64]
#: Times from which they are asked for block by block, and of so many in a block.
LONG, BLOCK = 1 << 14, 1 << 10
#: Part of a step by which evenly spaced times may be off.
UNEVEN = 1e-7


def waves(frequency: float, time: Array) -> Array:
    """Sine and cosine of 2πft, shape (2, n).

    Of evenly spaced times by sin(a + b), a at the start of a block and b within it: two products in place of two functions.
    """
    turn = 2.0 * np.pi * frequency
    n = time.size
    if n < LONG or not _even(time):
        angle = turn * time
        return np.stack([np.sin(angle), np.cos(angle)])
    step = (time[-1] - time[0]) / (n - 1)
    first = turn * time[::BLOCK]
    within = turn * step * np.arange(BLOCK)
    left = np.stack([np.sin(first), np.cos(first)], axis=-1)
    right = np.stack([np.cos(within), np.sin(within)])
    out = np.empty((2, first.size * BLOCK))
    np.matmul(left, right, out=out[0].reshape(first.size, BLOCK))
    np.matmul(left[:, ::-1] * [1.0, -1.0], right, out=out[1].reshape(first.size, BLOCK))
    return out[:, :n]


def _even(time: Array) -> bool:
    step = (time[-1] - time[0]) / (time.size - 1)
    off = np.arange(time.size, dtype=np.float64)
    off *= step
    off -= time - time[0]
    return bool(step > 0.0 and max(off.max(), -off.min()) < UNEVEN * step)

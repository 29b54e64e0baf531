"""Sines and cosines of whole records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["sines", "sines_pointwise", "waves"]

Array = NDArray[np.float64]
#: Times from which they are asked for block by block, and of so many in a block.
LONG, BLOCK = 1 << 14, 1 << 10
#: So many stay near the processor.
NEAR = 1 << 13
#: Part of a step by which evenly spaced times may be off.
UNEVEN = 1e-7


def waves(frequency: float, time: Array) -> Array:
    """Sine and cosine of 2πft, shape (2, n)."""
    turn = 2.0 * np.pi * frequency
    return np.array([sines([(turn, 1.0, phase)], time) for phase in (0.0, 0.5 * np.pi)])


def sines(lines: Sequence[tuple[float, float, float]], time: Array) -> Array:
    """Σ A sin(ωt + φ) of each (ω in rad/s, A, φ), shape (n,).

    Of evenly spaced times by sin(a + b), a at the start of a block and b within it: two products in place of a function.
    """
    n = time.size
    turn, amplitude, phase = np.array(lines, dtype=np.float64).reshape(-1, 3).T
    if n < LONG or not _even(time):
        return sines_pointwise(lines, time)
    step = (time[-1] - time[0]) / (n - 1)
    first = np.multiply.outer(time[::BLOCK], turn) + phase
    within = np.multiply.outer(turn * step, np.arange(BLOCK))
    left = np.concatenate([amplitude * np.sin(first), amplitude * np.cos(first)], axis=1)
    right = np.concatenate([np.cos(within), np.sin(within)])
    return (left @ right).reshape(-1)[:n]


def sines_pointwise(lines: Sequence[tuple[float, float, float]], time: Array) -> Array:
    """`sines`, of which each depends on its own time alone."""
    total = np.zeros(time.size)
    for turn, amplitude, phase in lines:
        part = turn * time
        part += phase
        np.sin(part, out=part)
        part *= amplitude
        total += part
    return total


def _even(time: Array) -> bool:
    """Whether times are a step apart, all of them."""
    step = (time[-1] - time[0]) / (time.size - 1)
    if not step > 0.0:
        return False
    within = step * np.arange(NEAR)
    for first in range(0, time.size, NEAR):
        part = time[first : first + NEAR]
        off = part - (time[0] + step * first)
        off -= within[: part.size]
        if max(off.max(), -off.min()) >= UNEVEN * step:
            return False
    return True

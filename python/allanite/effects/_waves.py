"""Fast sines and cosines of whole records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.effects._declared import Array

#: Minimum number of times for which sines are computed by blocks; fewer are computed one by one. Chosen by judgment; not
#: measured.
MIN_BLOCKED_TIMES = 1 << 14
#: Number of times in a block. Chosen by judgment; not measured.
BLOCK_TIMES = 1 << 10
#: Number of times tested at once for even spacing; they fit into the processor cache. Chosen by judgment; not measured.
CACHED_TIMES = 1 << 13
#: Maximum deviation of a time from even spacing for the computation by blocks, as a fraction of the step. Chosen by
#: judgment; not measured.
MAX_UNEVENNESS = 1e-7


def waves(frequency: float, time: Array) -> Array:
    """Array of sine and cosine of 2πft at each time (s), shape (2, n)."""
    turn = 2.0 * np.pi * frequency
    return np.array([sines([(turn, 1.0, phase)], time) for phase in (0.0, 0.5 * np.pi)])


def sines(lines: Sequence[tuple[float, float, float]], time: Array) -> Array:
    """Sum of A sin(ωt + φ) over `lines` (ω in rad/s, A, φ in rad) at each time, shape (n,).

    At least 16384 evenly spaced times are computed by blocks with sin(a + b): a at the start of a block, b within it.
    """
    n = time.size
    turn, amplitude, phase = np.array(lines, dtype=np.float64).reshape(-1, 3).T
    if n < MIN_BLOCKED_TIMES or not _is_evenly_spaced(time):
        return sines_pointwise(lines, time)
    step = (time[-1] - time[0]) / (n - 1)
    first = np.multiply.outer(time[::BLOCK_TIMES], turn) + phase
    within = np.multiply.outer(turn * step, np.arange(BLOCK_TIMES))
    left = np.concatenate([amplitude * np.sin(first), amplitude * np.cos(first)], axis=1)
    right = np.concatenate([np.cos(within), np.sin(within)])
    return (left @ right).reshape(-1)[:n]


def sines_pointwise(lines: Sequence[tuple[float, float, float]], time: Array) -> Array:
    """Array of the sum of A sin(ωt + φ) over `lines` (ω in rad/s, A, φ in rad), computed time by time, shape (n,)."""
    total = np.zeros(time.size)
    for turn, amplitude, phase in lines:
        part = turn * time
        part += phase
        np.sin(part, out=part)
        part *= amplitude
        total += part
    return total


def _is_evenly_spaced(time: Array) -> bool:
    """True if the times are evenly spaced and increasing, within 10⁻⁷ of a step."""
    step = (time[-1] - time[0]) / (time.size - 1)
    if not step > 0.0:
        return False
    within = step * np.arange(CACHED_TIMES)
    for first in range(0, time.size, CACHED_TIMES):
        part = time[first : first + CACHED_TIMES]
        off = part - (time[0] + step * first)
        off -= within[: part.size]
        if max(off.max(), -off.min()) >= MAX_UNEVENNESS * step:
            return False
    return True

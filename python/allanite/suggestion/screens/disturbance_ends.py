"""Begin and end of a disturbance in a band: an octave rings before and after the disturbance itself.

The screen of exclusions finds the loud octave. Here the ringing is removed from its interval, so that no good samples are
excluded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.suggestion.constants import (
    MAX_QUIET_POWER_RATIO,
    MIN_POWER_VALUES,
    MIN_RINGING_POWER_RATIO,
    WINDOW_PERIODS,
)

#: Number of windows that begin within the length of one window.
OVERLAPPING_WINDOWS = 4


def without_ringing(
    samples: NDArray[np.float64], low: int, high: int, first: float, last: float
) -> tuple[float, float] | None:
    """Pair (start, end) of the part of a segment that is really loud in an octave, as fractions of the record; or None.

    The band-pass filter of an octave rings before and after a loud part, so the segment is too long. Power in short
    windows (8 periods of the octave) does not ring. `low` and `high` are the ordinates of the octave; `first` and `last`
    are the ends of the segment, as fractions of the record. None in three cases:

    * The segment is shorter than two windows.
    * Fewer than 64 windows lie outside of the segment.
    * No window in the segment has 100 times the median power of the windows outside.
    """
    n = samples.size
    length = WINDOW_PERIODS * 4 * n // (low + high)
    start, end = round(first * n), round(last * n)
    if end - start < 2 * length:
        return None
    window = np.hanning(length)
    inside = slice(low * length // (2 * n), high * length // (2 * n) + 1)

    def power(at: NDArray[np.int64]) -> NDArray[np.float64]:
        """Array of the power within the octave in each window that begins at one of the samples `at`."""
        pieces = np.lib.stride_tricks.sliding_window_view(samples, length)[at]
        found = np.fft.rfft(pieces * window, axis=1)[:, inside]
        return np.asarray((found.real**2 + found.imag**2).sum(axis=1))

    hop = length // OVERLAPPING_WINDOWS
    at = np.arange(max(0, start - length), min(n, end + length) - length + 1, hop)
    others = np.concatenate(
        [np.arange(0, start - length + 1, hop), np.arange(end, n - length + 1, hop)]
    )
    if others.size < MIN_POWER_VALUES:
        return None
    usual = float(np.median(power(others[:: others.size // MIN_POWER_VALUES])))
    there = power(at) / usual if usual > 0.0 else np.zeros(at.size)
    loud = at[there > MAX_QUIET_POWER_RATIO]
    if not there.size or there.max() < MIN_RINGING_POWER_RATIO:
        return None
    half = length // 2
    # A disturbance that reaches an end of the record begins or ends there.
    begin = start if loud[0] <= half else max(start, int(loud[0]) + half)
    close = end if loud[-1] + length + hop > n else min(end, int(loud[-1]) + half)
    return (begin / n, close / n) if begin < close else None

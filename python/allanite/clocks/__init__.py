"""Clocks and time servers: time error, ITU-T masks, jumps, noise, holdover, and the noise of each of several clocks.

Add a mask to the table in `masks.py`, and a noise model for uneven times in `noise.py`.
"""

from __future__ import annotations

from allanite.clocks.hat import ClockDeviation, Clocks, three_cornered_hat
from allanite.clocks.masks import MASKS, Mask, mask_named
from allanite.clocks.timing import AFTER, Timing, Timings, timing, timing_columns

__all__ = [
    "AFTER",
    "MASKS",
    "ClockDeviation",
    "Clocks",
    "Mask",
    "Timing",
    "Timings",
    "mask_named",
    "three_cornered_hat",
    "timing",
    "timing_columns",
]

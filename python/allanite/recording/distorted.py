"""Values that a dead zone or a dead band has distorted, so that no noise model describes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array

#: Kinds of findings about such values.
DISTORTIONS = ("dead_zone", "dead_band")
#: Minimum count of changes, or of equal samples, from which a distortion is stated. If the density of changes falls with
#: their size, at most half of the changes below twice the smallest are above it: 20 of 20 have a probability of 1e-6.
MIN_COUNT = 20
#: Minimum fraction of changes that are 0 with a dead band: that of repeats of a slow sensor (`repeats.MIN_SHARE`).
MIN_SHARE = 0.02
#: Minimum fraction of samples in a dead zone. One that holds a tenth of normal samples lowers N by 10 %:
#: 1 − 2z√(2/π) + z² of the variance remain, where z = 0.126 is half the width of the zone in standard deviations.
MIN_ZONE_SHARE = 0.1
#: Minimum ratio of the count of one value to that of each value near it. If the resolution is at most the standard
#: deviation of normal noise, the most frequent value occurs at most e^½ = 1.65 times as often as the next one.
MIN_RATIO = 5.0
#: Number of values near a value, on each side, with which its count is compared. Chosen by judgment: more values only lower
#: the ratio.
NEIGHBORS = 10


def dead_band_of(x: NDArray[Any]) -> float | None:
    """Smallest change of the samples, in their unit, if a log writes no smaller changes; None for other samples.

    Neighbors along the last axis of `x` are neighbors in time. Three conditions hold: at least 2 % of the samples repeat
    the one before; the values are resolved to less than half of the smallest change; and at least 20 changes are below
    twice the smallest change, so that smaller changes would be expected as well.
    """
    changes = np.abs(np.diff(x.astype(np.float64), axis=-1))
    changes = changes[np.isfinite(changes)]
    some = changes[changes > 0.0]
    if some.size < MIN_COUNT or some.size > (1.0 - MIN_SHARE) * changes.size:
        return None
    least = float(some.min())
    apart = np.diff(np.unique(x[np.isfinite(x)]).astype(np.float64))
    apart = apart[apart > 1e-6 * least]
    fine = apart[apart < 0.5 * least]
    if fine.size < MIN_COUNT:
        return None
    near = np.count_nonzero(some < 2.0 * least - float(fine.min()))
    return least if near >= MIN_COUNT else None


def dead_zone_of(blocks: Array, white: float, step: float) -> tuple[float, float, float] | None:
    """Tuple (value, share, ratio) of a value that far more samples have than any value near it; None without one.

    `share` is the fraction of the samples with this value. `ratio` is their count over that of the most frequent of the
    10 next values on each side. `blocks` (blocks, samples) lie at even distances over the record. None if the
    resolution `step` is larger than the standard deviation `white` of the white noise. The ratio is at least 5, the
    share at least 10 %, the value is inside the range, and all quarters of the record have it.
    """
    x = blocks[np.isfinite(blocks)]
    values, counts = np.unique(x, return_counts=True)
    if step > white or values.size <= 2 * NEIGHBORS:
        return None
    at = int(np.argmax(counts))
    near = np.delete(counts[max(at - NEIGHBORS, 0) : at + NEIGHBORS + 1], min(at, NEIGHBORS))
    ratio = float(counts[at] / near.max())
    there = x == values[at]
    quarters = [int(np.count_nonzero(part)) for part in np.array_split(there, 4)]
    share = float(np.mean(there))
    # A value at an end of the range is clipped.
    inside = 0 < at < values.size - 1
    if not inside or ratio < MIN_RATIO or share < MIN_ZONE_SHARE or min(quarters) < MIN_COUNT:
        return None
    return float(values[at]) + 0.0, share, ratio  # no −0

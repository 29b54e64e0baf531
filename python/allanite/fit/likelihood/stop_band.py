"""Bins in which a filter left next to nothing: they say nothing of the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.spectrum import Bins, bins_of

__all__ = [
    "NOTHING",
    "UNSEEN",
    "bins_seen",
    "empty",
    "empty_ranges",
    "mostly_empty",
    "without_empty",
]

#: Part of the density two octaves aside below which a bin is empty: there are the lobes of a filter's stop band, the
#: resolution of its arithmetic and what the ends of the transform leave, never the sensor.
DEEP = 1e-4
#: Part of the rate above which a filter's stop band is looked for, octaves within which its pass band has to be.
ABOVE, WITHIN = 1 / 32, 2.0
#: Degrees of freedom of an empty bin, each of its ordinates.
NOTHING = 1e-9
#: Times the density that is expected of a single ordinate there, so that none stands out.
UNSEEN = 1e12
#: Ordinates of a bin that is not empty by chance.
FEWEST = 16


def bins_seen(ordinates: NDArray[np.float64]) -> Bins:
    """Bins of a record with these ordinates, those that are empty without freedom."""
    bins = bins_of(ordinates.size)
    at = np.log2(bins.frequency(1.0))
    top = np.flatnonzero(at > np.log2(ABOVE))
    power = bins.power(ordinates)
    # A line raises few bins of an octave.
    usual = np.array([np.median(power[np.abs(at - here) < 0.5]) for here in at[top]])
    passed = np.array([usual[np.abs(at[top] - here) < WITHIN].max() for here in at[top]])
    deep = top[(power[top] < DEEP * passed) & (bins.count[top] >= FEWEST)]
    if deep.size == 0:
        return bins
    count = bins.count.copy()
    count[deep] *= NOTHING
    return replace(bins, count=count)


def empty(bins: Bins) -> NDArray[np.bool_]:
    """Whether each bin has no freedom, shape (bins,)."""
    return np.asarray(bins.count < 1e-6 * np.diff(bins.edges))


def empty_ranges(bins: Bins, rate: float) -> list[tuple[float, float]]:
    """Lowest and highest frequency of each run of empty bins, Hz."""
    low, high = bins.limits(rate)
    gone = np.concatenate([[False], empty(bins), [False]]).astype(np.int8)
    first, end = np.flatnonzero(np.diff(gone) == 1), np.flatnonzero(np.diff(gone) == -1)
    return [(float(low[a]), float(high[b - 1])) for a, b in zip(first, end, strict=True)]


def mostly_empty(bins: Bins, low: int, high: int) -> bool:
    """Whether more than half of the ordinates from `low` to before `high` are of empty bins."""
    width = np.diff(np.clip(bins.edges, low, high))
    return 2 * int(width[empty(bins)].sum()) > high - low


def without_empty(ordinates: NDArray[np.float64], bins: Bins) -> NDArray[np.float64]:
    """Ordinates, those of empty bins 0, in place."""
    for b in np.flatnonzero(empty(bins)):
        ordinates[bins.edges[b] : bins.edges[b + 1]] = 0.0
    return ordinates

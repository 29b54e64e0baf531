"""Detect bins in a filter's stop band (empty bins), which contain no information about the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, runs_of
from allanite.spectrum import Bins, bins_of

#: Maximum power of an empty bin, as a fraction of the pass-band power. Only the lobes of the stop band, the rounding of the
#: filter's arithmetic and the leakage from the ends are that low. Chosen by judgment; not measured.
MAX_EMPTY_POWER_RATIO = 1e-4
#: Frequency, as a fraction of the sampling rate, above which stop bands are detected. Chosen by judgment; not measured.
MIN_STOP_BAND_FREQUENCY = 1 / 32
#: Maximum distance of the pass band from an empty bin, octaves. Chosen by judgment; not measured.
PASS_BAND_OCTAVES = 2.0
#: Degrees of freedom of an ordinate in an empty bin: nearly 0, without divisions by zero.
EMPTY_BIN_FREEDOM = 1e-9
#: Factor by which the expected density of a single ordinate in an empty bin is multiplied, so that no ordinate stands out
#: there.
EMPTY_BIN_DENSITY_FACTOR = 1e12
#: Minimum number of ordinates of a bin that may be called empty. With 16 ordinates, power 1e-4 has no chance to be
#: random: (e·1e-4)^8. Chosen by judgment; not measured.
MIN_EMPTY_BIN_ORDINATES = 16


def bins_with_stop_band(ordinates: Array) -> Bins:
    """`Bins` of a record with these ordinates; empty bins (a filter's stop band) get nearly no degrees of freedom.

    An empty bin has at least 16 ordinates and a frequency above 1/32 of the sampling rate. Its power is less than 1e-4 of a
    reference: medians of the bin power are taken over one octave around each bin above this frequency. The reference is the
    largest of these medians within two octaves.
    """
    bins = bins_of(ordinates.size)
    at = np.log2(bins.frequency(1.0))
    top = np.flatnonzero(at > np.log2(MIN_STOP_BAND_FREQUENCY))
    power = bins.power(ordinates)
    # The median of an octave is robust against lines, which raise few bins.
    usual = np.array([np.median(power[np.abs(at - here) < 0.5]) for here in at[top]])
    passed = np.array([usual[np.abs(at[top] - here) < PASS_BAND_OCTAVES].max() for here in at[top]])
    deep = top[
        (power[top] < MAX_EMPTY_POWER_RATIO * passed) & (bins.count[top] >= MIN_EMPTY_BIN_ORDINATES)
    ]
    if deep.size == 0:
        return bins
    count = bins.count.copy()
    count[deep] *= EMPTY_BIN_FREEDOM
    return replace(bins, count=count)


def is_empty(bins: Bins) -> NDArray[np.bool_]:
    """Mask of the empty bins, shape (bins,): those with nearly no degrees of freedom (the stop band of a filter)."""
    return np.asarray(bins.count < 1e-6 * np.diff(bins.edges))


def empty_ranges(bins: Bins, rate: float) -> list[tuple[float, float]]:
    """List of the frequency ranges (low, high), Hz, of consecutive empty bins (a filter's stop band)."""
    low, high = bins.limits(rate)
    runs = zip(*runs_of(is_empty(bins)), strict=True)
    return [(float(low[first]), float(high[end - 1])) for first, end in runs]


def is_mostly_empty(bins: Bins, low: int, high: int) -> bool:
    """True if more than half of the ordinates from `low` to before `high` lie in empty bins (a filter's stop band)."""
    width = np.diff(np.clip(bins.edges, low, high))
    return 2 * int(width[is_empty(bins)].sum()) > high - low


def zero_empty_bins(ordinates: Array, bins: Bins) -> Array:
    """Set the ordinates in empty bins (the stop band of a filter, `is_empty`) to 0 in place, and return the same array."""
    for b in np.flatnonzero(is_empty(bins)):
        ordinates[bins.edges[b] : bins.edges[b + 1]] = 0.0
    return ordinates

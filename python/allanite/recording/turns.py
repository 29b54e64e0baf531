"""Turns of a platform: the rate of a gyroscope leaves its usual level for some seconds and returns."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from allanite.common.arrays import Array, runs_of

#: Averaging time of the search for turns, s.
AVERAGING_TIME = 1.0
#: Minimum rate within a turn, deg/s. The bias instability of the worst MEMS gyroscopes is 0.05 deg/s.
MIN_RATE = 1.0
#: Minimum rate in standard errors of the averages, and minimum number of averages in a row: three of 6 σ do not occur by
#: chance.
MIN_ERRORS, MIN_AVERAGES = 6.0, 3
#: Minimum angle of a turn, degrees.
MIN_ANGLE = 10.0
#: Longest turn, s. A rate that stays longer is a step or a warm-up of the bias.
MAX_SECONDS = 60.0


def turns_of(rates: Array, rate: float) -> list[tuple[float, float, float]]:
    """List of (start in s, end in s, angle in degrees) of each turn in the samples of a gyroscope, sorted by start.

    A turn lasts 3 to 60 s, reaches at least 10°, and exceeds 1 deg/s and six times the noise of averages of 1 s. Empty
    for fewer than six averages.

    Parameters
    ----------
    rates : ndarray of shape (n,)
        Samples, deg/s; NaN for missing ones.
    rate : float
        Sampling rate, Hz.
    """
    m = max(1, round(AVERAGING_TIME * rate))
    seconds = m / rate
    count = rates.size // m
    window = 2 * round(MAX_SECONDS / seconds) + 1
    if count < 2 * MIN_AVERAGES or window < 2 * MIN_AVERAGES:
        return []
    groups = rates[: count * m].reshape(count, m)
    present = np.isfinite(groups)
    average = np.where(present, groups, 0.0).sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    places = np.flatnonzero(present.any(axis=1))
    average = average[places]
    if places.size < 2 * MIN_AVERAGES:
        return []
    # A step of the bias moves the median with it; a turn is shorter than half of the window.
    usual = median_filter(average, size=min(window, average.size), mode="nearest")
    change = average - usual
    # Noise may be louder for a while. A turn is smooth: its second differences are those of the noise.
    bends = np.abs(np.diff(average, 2, prepend=average[:1], append=average[-1:])) / np.sqrt(6.0)
    local = median_filter(bends, size=min(window, average.size), mode="nearest") / 0.6745
    error = np.maximum(local, float(np.median(np.abs(change))) / 0.6745)
    limit = np.maximum(MIN_RATE, MIN_ERRORS * error)
    found = []
    for sign in (1.0, -1.0):
        fast = sign * change > limit
        for first, end in zip(*(edge.tolist() for edge in runs_of(fast)), strict=True):
            angle = float(change[first:end].sum()) * seconds
            short = end - first < MIN_AVERAGES or (end - first) * seconds > MAX_SECONDS
            if not short and abs(angle) >= MIN_ANGLE:
                # A turn begins and ends slower than the limit.
                start, stop = max(int(places[first]) - 2, 0), int(places[end - 1]) + 3
                found.append((start * seconds, min(stop, count) * seconds, angle))
    return sorted(found)

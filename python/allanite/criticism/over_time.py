"""Residuals over time: the map of measured over expected power in segments of time and octaves of frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array, run_at
from allanite.common.documents import rows_of
from allanite.common.showing import brief
from allanite.fit.likelihood.whittle import normal_scores

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened

#: Number of equal time segments of the map. A change that lasts 3 % of the record fills one segment, and slow octaves still
#: have a few values in each.
SEGMENTS = 32
#: Minimum number of values per cell of the map, on average; octaves with fewer are omitted. Chosen by judgment; not
#: measured.
MIN_CELL_VALUES = 4
#: Maximum number of time cells whose scatter is compared with that of χ². Chosen by judgment; not measured.
MAX_CELLS = 256
#: Minimum |z| of a cell that counts as a failure. The largest |z| of 450 cells exceeds it in about 0.2 % of true models.
MIN_CELL_SCORE = 4.6


@dataclass(frozen=True, slots=True, eq=False)
class TimeMap:
    """Measured over expected power in cells of time and frequency, and normal scores.

    `ratio` and `z` have the shape (bands, segments); the other fields are the limits of segments, s, and of bands, Hz.
    """

    start_s: Array
    end_s: Array
    low_hz: Array
    high_hz: Array
    ratio: Array
    z: Array

    __repr__ = brief

    def rows(self) -> list[dict[str, Any]]:
        """List of dicts, one per octave and time segment: their limits (Hz, s), measured over expected power, score z."""
        limits = (self.start_s, self.end_s, self.low_hz[:, None], self.high_hz[:, None])
        start, end, low, high = (np.broadcast_to(each, self.z.shape) for each in limits)
        return rows_of(
            start_s=start, end_s=end, low_hz=low, high_hz=high, ratio=self.ratio, z=self.z
        )

    def worst(self) -> tuple[float, float] | None:
        """Pair (start, end) in s of the time in which the power deviates most; None if the largest |z| is below 4.6.

        It is the segment with the largest |z|, in any octave, and its neighbors in time in which z of the same octave has
        the same sign and exceeds 2 in magnitude.
        """
        if self.z.size == 0:
            return None
        band, top = np.unravel_index(int(np.argmax(np.abs(self.z))), self.z.shape)
        row = self.z[band]
        if abs(row[top]) < MIN_CELL_SCORE:
            return None
        low, high = run_at(row * np.sign(row[top]) > 2.0, int(top))
        return float(self.start_s[low]), float(self.end_s[high])


def time_map(data: Data, whitened: Whitened) -> TimeMap:
    """`TimeMap`: ratio of measured to expected power, and its score z, per octave of frequency and per time segment.

    Octaves with at most 4 values per segment, on average, are omitted. z compares a segment with the mean of its octave
    over the record, so that only changes over time count. For heavy-tailed noise, z is computed from normal scores of the
    samples (`Whitened.with_normal_tails`).
    """
    bands = [band for band in whitened.bands[::-1] if band[2].size > MIN_CELL_VALUES * SEGMENTS]
    edges = np.linspace(data.start, data.start + data.duration, SEGMENTS + 1)
    half = data.rate / (2.0 * data.n)
    ratio, z = [], []
    judged = {band[0]: band[2] for band in whitened.with_normal_tails.bands}
    for low, _, power, each in bands:
        place = np.floor((np.arange(power.size) + 0.5) * SEGMENTS / power.size).astype(int)
        count = np.bincount(place, minlength=SEGMENTS).astype(float)
        mean = np.bincount(place, weights=power, minlength=SEGMENTS) / count
        scored = judged[low]
        count = count * each / overdispersion(scored, each)
        ratio.append(mean)
        if scored is not power:
            mean = np.bincount(place, weights=scored, minlength=SEGMENTS) / np.bincount(place)
        z.append(normal_scores(mean / np.mean(mean), count, np.ones(SEGMENTS)))
    return TimeMap(
        edges[:-1],
        edges[1:],
        np.array([b[0] for b in bands]) * half,
        np.array([b[1] for b in bands]) * half,
        np.array(ratio).reshape(len(bands), SEGMENTS),
        np.array(z).reshape(len(bands), SEGMENTS),
    )


def overdispersion(power: Array, each: float = 1.0) -> float:
    """Factor, at least 1, by which the local mean of a power varies over time more than the χ² distribution predicts.

    Each value of `power` is the mean of `each` squared normal samples. The values are averaged in 16 or more blocks of
    equal length. The factor is the variance of the block means, over that of χ² and over 1 + 4/√blocks, a margin for its
    random error. The result is the largest factor for several numbers of blocks. 1 for fewer than 64 values.
    """
    found = 1.0
    cells = min(MAX_CELLS, power.size // MIN_CELL_VALUES)
    while cells >= SEGMENTS // 2:
        size = power.size // cells
        means = power[: cells * size].reshape(cells, size).mean(axis=1)
        # The median of squares ignores a few changes of level.
        scatter = 0.5 * float(np.median(np.diff(means) ** 2)) / 0.4549 / float(np.mean(means)) ** 2
        found = max(found, scatter * size * each / 2.0 / (1.0 + 4.0 / np.sqrt(cells)))
        cells //= 2
    return found

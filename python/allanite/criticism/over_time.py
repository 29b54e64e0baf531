"""When does the model fail? The (time × octave band) map of measured over expected power."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.fit.likelihood.whitened import with_normal_tails
from allanite.fit.likelihood.whittle import normal_scores

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened

__all__ = ["TimeMap", "overdispersion", "time_map"]

#: Segments of the record: a change that lasts 3 % of it fills one, and the slow octaves still have a few values in each.
SEGMENTS = 32
#: A cell with fewer values than this is not judged.
FEWEST = 4
#: Stretches whose scatter is compared with that of χ².
CELLS = 256
#: About 0.2 % for the largest of 450 cells.
THRESHOLD = 4.6


@dataclass(frozen=True, slots=True, eq=False)
class TimeMap:
    """Measured over expected power, shape (bands, segments), its degrees of freedom (bands,) and scores z."""

    start_s: NDArray[np.float64]
    end_s: NDArray[np.float64]
    low_hz: NDArray[np.float64]
    high_hz: NDArray[np.float64]
    ratio: NDArray[np.float64]
    z: NDArray[np.float64]

    __repr__ = brief

    def rows(self) -> list[dict[str, Any]]:
        """One record a cell, as in the contract."""
        return [
            {
                "start_s": float(self.start_s[s]),
                "end_s": float(self.end_s[s]),
                "low_hz": float(self.low_hz[b]),
                "high_hz": float(self.high_hz[b]),
                "ratio": float(self.ratio[b, s]),
                "z": float(self.z[b, s]),
            }
            for b in range(self.low_hz.size)
            for s in range(self.start_s.size)
        ]

    def worst(self) -> tuple[float, float] | None:
        """The time about the cell that differs most from the rest of its band, if by more than chance allows."""
        if self.z.size == 0:
            return None
        band, top = np.unravel_index(int(np.argmax(np.abs(self.z))), self.z.shape)
        row = self.z[band]
        if abs(row[top]) < THRESHOLD:
            return None
        same = row * np.sign(row[top]) > 2.0
        low = high = int(top)
        while low > 0 and same[low - 1]:
            low -= 1
        while high < row.size - 1 and same[high + 1]:
            high += 1
        return float(self.start_s[low]), float(self.end_s[high])


def time_map(data: Data, whitened: Whitened) -> TimeMap:
    """32 segments × octaves; z compares a cell with its band's mean, isolating changes in time."""
    bands = [band for band in whitened.bands[::-1] if band[2].size > FEWEST * SEGMENTS]
    edges = np.linspace(data.start, data.start + data.duration, SEGMENTS + 1)
    half = data.rate / (2.0 * data.n)
    ratio, z = [], []
    judged = {band[0]: band[2] for band in with_normal_tails(whitened).bands}
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


def overdispersion(power: NDArray[np.float64], each: float = 1.0) -> float:
    """By how much the power of neighbouring stretches scatters more than χ² does, at least 1.

    Heavy tails and bands narrower than an octave leave fewer independent values than there are; differences of
    neighbours see no change of level. Each value is the mean of `each` squares.
    """
    found = 1.0
    cells = min(CELLS, power.size // FEWEST)
    while cells >= SEGMENTS // 2:
        size = power.size // cells
        means = power[: cells * size].reshape(cells, size).mean(axis=1)
        # The median of squares: a few changes of level are no scatter.
        scatter = 0.5 * float(np.median(np.diff(means) ** 2)) / 0.4549 / float(np.mean(means)) ** 2
        found = max(found, scatter * size * each / 2.0 / (1.0 + 4.0 / np.sqrt(cells)))
        cells //= 2
    return found

"""When does the model fail? The (time × octave band) map of measured over expected power.

The residual ordinates, whitened by the model, are cut into octave bands; the inverse cosine transform of a band's ordinates
alone is a series of as many values as the band has ordinates, each local in time (a Wilson basis): their squares are the
band's power over time, χ²₁ each where the model holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.showing import brief
from allanite.fit.data import density
from allanite.fit.whittle import normal_scores

if TYPE_CHECKING:
    from allanite.fit.data import Data
    from allanite.fit.engine import Solution

__all__ = [
    "TimeMap",
    "Whitened",
    "expected_level",
    "overdispersion",
    "time_map",
    "whiten",
    "whitened_ordinates",
]

SEGMENTS = 32
#: A cell with fewer values than this is not judged.
FEWEST = 4
#: Fewest values of a band.
BAND = 256
#: Samples at either end of a record of which the time view says nothing, at most; a sixty-fourth of a short one.
ENDS = 64
#: Stretches whose scatter is compared with that of χ².
CELLS = 256
#: About 0.2 % for the largest of 450 cells.
THRESHOLD = 4.6


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """The residual over the root of the density that is probably there: the model's, corrected where it is wrong.

    White of variance 1 at all frequencies, so that what differs between times is a matter of time.

    Attributes
    ----------
    samples : ndarray, shape (n,)
        Over time.
    bands : tuple
        (first ordinate, end, power over time) of each octave from the top, while it has `BAND` values.
    """

    samples: NDArray[np.float64]
    bands: tuple[tuple[int, int, NDArray[np.float64]], ...]

    __repr__ = brief


def whiten(solution: Solution, data: Data) -> Whitened:
    """The whitened residual of a solution, over time and in octaves."""
    white = whitened_ordinates(solution, data, solution.level)
    # Behind a deep stop band the ends of the transform, not the record, stand out.
    ends = min(ENDS, data.n // 64)
    bands = []
    high = data.n
    while high - (low := high // 2) >= BAND:
        series = np.concatenate([[0.0], white[low:high]])
        power = _kernels.inverse_cosine_transform(series) ** 2
        edge = -(-ends * power.size // data.n)
        power[:edge] = power[power.size - edge :] = power[edge : power.size - edge].mean()
        bands.append((low, high, power))
        high = low
    samples = _kernels.inverse_cosine_transform(white)
    samples[:ends] = samples[data.n - ends :] = 0.0
    return Whitened(samples, tuple(bands))


def whitened_ordinates(
    solution: Solution, data: Data, level: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Residual ordinates over the root of the model's density times the level of each bin, shape (n,)."""
    bins = data.bins
    known = np.log(density(data.terms(solution.model), bins.nodes, data.n) * level[bins.owner])
    j = np.maximum(np.arange(data.n, dtype=np.float64), 1.0)
    white = np.interp(np.log(j, out=j), np.log(bins.nodes), known)
    white *= -0.5
    np.exp(white, out=white)
    white *= solution.ordinates
    return white


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


def time_map(solution: Solution, data: Data, whitened: Whitened) -> TimeMap:
    """Cells of 32 segments by octaves; z compares a cell with its band's mean, so that it speaks of time alone."""
    bands = [band for band in whitened.bands[::-1] if band[2].size > FEWEST * SEGMENTS]
    edges = np.linspace(data.start, data.start + data.duration, SEGMENTS + 1)
    half = data.rate / (2.0 * data.n)
    expected = expected_level(solution, edges)
    ratio, z = [], []
    for low, high, power in bands:
        place = np.floor((np.arange(power.size) + 0.5) * SEGMENTS / power.size).astype(int)
        count = np.bincount(place, minlength=SEGMENTS).astype(float)
        mean = np.bincount(place, weights=power, minlength=SEGMENTS) / count
        count = count / overdispersion(power)
        share = _white_share(solution, data, (low + high) // 2)
        mean = mean / (1.0 + share * (expected - 1.0))
        ratio.append(mean)
        z.append(normal_scores(mean / np.mean(mean), count, np.ones(SEGMENTS)))
    return TimeMap(
        edges[:-1],
        edges[1:],
        np.array([b[0] for b in bands]) * half,
        np.array([b[1] for b in bands]) * half,
        np.array(ratio).reshape(len(bands), SEGMENTS),
        np.array(z).reshape(len(bands), SEGMENTS),
    )


def overdispersion(power: NDArray[np.float64]) -> float:
    """By how much the power of neighbouring stretches scatters more than χ² does, at least 1.

    Heavy tails and bands narrower than an octave leave fewer independent values than there are; differences of
    neighbours see no change of level.
    """
    found = 1.0
    cells = min(CELLS, power.size // FEWEST)
    while cells >= SEGMENTS // 2:
        size = power.size // cells
        means = power[: cells * size].reshape(cells, size).mean(axis=1)
        # The median of squares: a few changes of level are no scatter.
        scatter = 0.5 * float(np.median(np.diff(means) ** 2)) / 0.4549 / float(np.mean(means)) ** 2
        found = max(found, scatter * size / 2.0 / (1.0 + 4.0 / np.sqrt(cells)))
        cells //= 2
    return found


def expected_level(solution: Solution, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """White power of each segment over the record's mean, from the level changes of the model."""
    power = np.ones(edges.size - 1)
    for effect in solution.model.modifiers:
        if effect.passing:
            power *= effect.mean_power(edges[:-1], edges[1:])
    return np.asarray(power / power.mean())


def _white_share(solution: Solution, data: Data, ordinate: int) -> float:
    """Part of the model's density at an ordinate that its white effect makes."""
    j = np.array([ordinate])
    total = density(data.terms(solution.model), j, data.n)[0]
    for effect, theta in zip(solution.model.stochastic, solution.theta, strict=True):
        if effect.white:
            return float(
                theta * density(data.unit_terms(solution.model, effect), j, data.n)[0] / total
            )
    return 0.0

"""Power over time of the octaves of a summary (its spectrogram)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.likelihood.sections import Cells
from allanite.summary.lapped import LOW, SEGMENT, low_pass_gain
from allanite.summary.level import FINE, TILE

if TYPE_CHECKING:
    from allanite.summary.reading import Reading
    from allanite.summary.sums import Blocks

#: Number of time cells for the power of an octave over time. Chosen by judgment; not measured.
TIME_CELLS = 160


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """Power over time of a summary on the time axis of its record, of n samples at `rate` Hz.

    `start` is the index of the record's first sample in its stream.
    """

    reading: Reading
    rate: float
    start: int
    n: int

    __repr__ = brief

    @property
    def limits(self) -> tuple[float, float]:
        """Pair: lowest and highest frequency whose power over time is kept, Hz."""
        top = LOW / SEGMENT * self.rate
        return top / (1 << len(self.reading.octaves)), top

    @property
    def cells(self) -> Array:
        """Array of the edges of 160 equal time cells (`TIME_CELLS`), in samples of the record, shape (161,)."""
        return np.linspace(0.0, self.n, TIME_CELLS + 1)

    def edges(self, blocks: Blocks, level: int) -> Array:
        """Edges of successive time `blocks` of octave `level`, in samples of the record, shape (blocks + 1,).

        Edges outside the record are moved to its ends.
        """
        size = float((TILE << blocks.size) << level)
        edges = (blocks.first + np.arange(blocks.frames.size + 1)) * size - self.start
        return np.asarray(edges.clip(0.0, self.n))

    def at_octave_resolution(self, power: Array, level: int) -> Array:
        """`power` in 160 equal time cells, averaged within the time blocks for which the summary keeps octave `level`."""
        edges = np.unique(self.edges(self.reading.octaves[level].blocks, level))
        # Incomplete blocks at the ends are joined with their neighbor.
        edges[0], edges[-1] = 0.0, self.n
        means = redistributed(power, self.cells, edges) / redistributed(
            np.ones(TIME_CELLS), self.cells, edges
        )
        sizes = np.diff(edges)
        return redistributed(means * sizes, edges, self.cells) / redistributed(
            sizes, edges, self.cells
        )


class SectionsOfSummary:
    """`number` equal time sections of a summary's spectrogram."""

    def __init__(self, maps: Maps, number: int) -> None:
        self.maps, self.number, self.limits = maps, number, maps.limits

    def cells(self, within: tuple[float, float], _step: float) -> Cells:
        """`Cells`: power of each section in the stored frequency cells between the two frequencies `within`, Hz.

        The width of the cells is fixed by the summary; `_step` is not used.
        """
        maps, power, count, at = self.maps, [], [], []
        ends = np.linspace(0.0, maps.n, self.number + 1)
        for level, octave in enumerate(maps.reading.octaves):
            edges, middle, left = fine_bands(level)
            hertz = maps.rate / (2.0 * SEGMENT * (1 << level))
            inside = (edges[:-1] * hertz > within[0]) & (edges[1:] * hertz < within[1])
            if not inside.any():
                continue
            # Fraction of each block that lies in each section.
            block = maps.edges(octave.sections, level)
            common = np.minimum(ends[1:, None], block[1:]) - np.maximum(ends[:-1, None], block[:-1])
            share = np.clip(common, 0.0, None) / np.maximum(np.diff(block), 1e-9)
            number = np.outer(share @ octave.sections.frames, np.diff(edges))[:, inside]
            total = (share @ octave.sections.sums.value / left)[:, inside]
            power.append(total / np.maximum(number, 1e-9))
            count.append(number)
            at.append((np.round(middle[inside]).astype(np.int64), SEGMENT << level))
        return Cells(np.hstack(power), np.hstack(count), tuple(at))


def redistributed(values: Array, edges: Array, others: Array) -> Array:
    """Sums in cells with the edges `others`, from the sums `values` in cells with the edges `edges`, spread evenly."""
    return np.diff(np.interp(others, edges, np.concatenate([[0.0], np.cumsum(values)])))


def fine_bands(level: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Tuple (edges, middles, gains) of the fine frequency bands of an octave, after `level` halvings of the sampling rate.

    Edges, shape (bands + 1,), and middles, shape (bands,), are indices of the cosine transform of one time segment. The
    gain of a band is the expected squared coefficient, divided by the density of the record at the same frequency.
    """
    edges = LOW + np.arange(FINE + 1, dtype=np.int64) * LOW // FINE
    middle = np.asarray(0.5 * (edges[1:] + edges[:-1]), dtype=np.float64)
    left = low_pass_gain(middle / (2.0 * SEGMENT * 2.0**level), level) ** 2 / 2.0**level
    return edges, middle, left

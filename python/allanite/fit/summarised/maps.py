"""Power over time of the octaves that a summary keeps in segments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.fit.likelihood.sections import Cells
from allanite.summary.lapped import LOW, SEGMENT, gain
from allanite.summary.level import FINE, TILE

if TYPE_CHECKING:
    from allanite.summary.reading import Reading
    from allanite.summary.sums import Blocks

__all__ = ["CELLS", "Maps", "SectionsOfSummary", "fine_bands", "shared"]

Array = NDArray[np.float64]
#: Cells of the time axis in which octaves of segments are looked at.
CELLS = 160


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """The maps of a summary, and where on the time axis of its record they are.

    Attributes
    ----------
    reading : Reading
    rate : float
        Hz.
    start, n : int
        First sample of the record in its stream, and samples.
    """

    reading: Reading
    rate: float
    start: int
    n: int

    __repr__ = brief

    @property
    def limits(self) -> tuple[float, float]:
        """Frequencies between which power is kept over time, Hz."""
        top = LOW / SEGMENT * self.rate
        return top / (1 << len(self.reading.octaves)), top

    @property
    def cells(self) -> Array:
        """Edges of the cells of the time axis, in samples of the record."""
        return np.linspace(0.0, self.n, CELLS + 1)

    def edges(self, blocks: Blocks, level: int) -> Array:
        """Where the blocks of an octave begin and end, in samples of the record."""
        size = float((TILE << blocks.size) << level)
        edges = (blocks.first + np.arange(blocks.frames.size + 1)) * size - self.start
        return np.asarray(edges.clip(0.0, self.n))

    def as_seen(self, power: Array, level: int) -> Array:
        """Power in cells as the map of an octave shows it: where a block is longer, its mean."""
        edges = np.unique(self.edges(self.reading.octaves[level].blocks, level))
        # What is less than a block at an end is with its neighbour.
        edges[0], edges[-1] = 0.0, self.n
        means = shared(power, self.cells, edges) / shared(np.ones(CELLS), self.cells, edges)
        sizes = np.diff(edges)
        return shared(means * sizes, edges, self.cells) / shared(sizes, edges, self.cells)


class SectionsOfSummary:
    """Equal sections of the octaves that are kept."""

    def __init__(self, maps: Maps, number: int) -> None:
        self.maps, self.number, self.limits = maps, number, maps.limits

    def cells(self, within: tuple[float, float], _step: float) -> Cells:
        """The cells that are kept between two frequencies, Hz, as wide as they are."""
        maps, power, count, at = self.maps, [], [], []
        ends = np.linspace(0.0, maps.n, self.number + 1)
        for level, octave in enumerate(maps.reading.octaves):
            edges, middle, left = fine_bands(level)
            hertz = maps.rate / (2.0 * SEGMENT * (1 << level))
            inside = (edges[:-1] * hertz > within[0]) & (edges[1:] * hertz < within[1])
            if not inside.any():
                continue
            # Of each section the share of the blocks that lie in it.
            block = maps.edges(octave.sections, level)
            common = np.minimum(ends[1:, None], block[1:]) - np.maximum(ends[:-1, None], block[:-1])
            share = np.clip(common, 0.0, None) / np.maximum(np.diff(block), 1e-9)
            number = np.outer(share @ octave.sections.frames, np.diff(edges))[:, inside]
            total = (share @ octave.sections.sums.value / left)[:, inside]
            power.append(total / np.maximum(number, 1e-9))
            count.append(number)
            at.append((np.round(middle[inside]).astype(np.int64), SEGMENT << level))
        return Cells(np.hstack(power), np.hstack(count), tuple(at))


def shared(values: Array, edges: Array, others: Array) -> Array:
    """Sums of values between edges, between other edges: of each the share that lies there."""
    return np.diff(np.interp(others, edges, np.concatenate([[0.0], np.cumsum(values)])))


def fine_bands(level: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Edges and middles of the fine bands of a level, in its coefficients, and what is left there of a density."""
    edges = LOW + np.arange(FINE + 1, dtype=np.int64) * LOW // FINE
    middle = np.asarray(0.5 * (edges[1:] + edges[:-1]), dtype=np.float64)
    left = gain(middle / (2.0 * SEGMENT * 2.0**level), level) ** 2 / 2.0**level
    return edges, middle, left

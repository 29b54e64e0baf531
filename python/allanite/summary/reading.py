"""What the stretches of one column tell together: the octaves of its spectrum and, below them, its samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.summary.ends import depth_of, read
from allanite.summary.level import KEEP, Octave
from allanite.summary.sums import Sum

if TYPE_CHECKING:
    from allanite.summary.level import Level

__all__ = ["Reading", "read_column"]


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """A column, read to its ends.

    Attributes
    ----------
    octaves : tuple of Octave
        From the top; as many as halvings of the rate.
    samples : ndarray, shape (m,)
        At 2^−len(octaves) of the rate; NaN where the record has too many missing.
    start : int
        Index of the first of them, at their own rate.
    """

    octaves: tuple[Octave, ...]
    samples: NDArray[np.float64]
    start: int

    __repr__ = brief

    @property
    def factor(self) -> int:
        """Samples of the record to one that is kept."""
        return 1 << len(self.octaves)


def read_column(levels: list[Level], depth: int | None = None) -> Reading:
    """Read stretches of one stream, in order; `depth` at least where each keeps its samples."""
    if depth is None:
        depth = max(depth_of(level) for level in levels)
        while (levels[-1].stop - levels[0].start) >> depth > 2 * KEEP:
            depth += 1
    found = [read(level, depth) for level in levels]
    first = min(one.start for one in found)
    samples = np.full(max(one.start + one.samples.size for one in found) - first, np.nan)
    for one in found:
        samples[one.start - first : one.start - first + one.samples.size] = one.samples
    octaves = []
    for at in range(depth):
        total = Octave(Sum.zeros(found[0].octaves[at].power.high.size))
        for one in found:
            total.add(one.octaves[at])
        octaves.append(total)
    return Reading(tuple(octaves), samples, first)

"""Reading of one column of a summary: octaves of its spectrum, and low-rate samples for the frequencies below them."""

from __future__ import annotations

import numpy as np

from allanite.summary.ends import Reading, depth_of, read_segment
from allanite.summary.level import MAX_KEPT_SAMPLES, Level, Octave
from allanite.summary.sums import Sum


def read_column(levels: list[Level], depth: int | None = None) -> Reading:
    """`Reading` (spectrum in octaves, and low-rate samples) of one column from the levels of its stream segments.

    The levels are in time order; samples between segments are NaN. `depth` is the number of octaves. By default, it is
    the smallest depth at which every segment keeps all samples and the total is at most 2^19 samples.
    """
    if depth is None:
        depth = max(depth_of(level) for level in levels)
        while (levels[-1].stop - levels[0].start) >> depth > 2 * MAX_KEPT_SAMPLES:
            depth += 1
    found = [read_segment(level, depth) for level in levels]
    first = min(one.start for one in found)
    samples = np.full(max(one.start + one.samples.size for one in found) - first, np.nan)
    for one in found:
        samples[one.start - first : one.start - first + one.samples.size] = one.samples
    octaves = []
    for at in range(depth):
        total = Octave(power=Sum.zeros(found[0].octaves[at].power.high.size))
        for one in found:
            total.add(one.octaves[at])
        octaves.append(total)
    return Reading(tuple(octaves), samples, first)

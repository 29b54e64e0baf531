"""Reading of a column of a summary: octaves of its spectrum, and low-rate samples for the frequencies below them.

Each stream segment of the column is read as its finished tiles and its two ends. Beyond the ends of the record, the samples
are mirrored, as the cosine transform assumes. No transform segment crosses an end.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.summary.gaps import fill_missing
from allanite.summary.lapped import LOW, REACH, SEGMENT, halved, resample_power, transform_at_end
from allanite.summary.level import (
    MARGIN,
    MAX_KEPT_SAMPLES,
    TILE,
    Level,
    Octave,
    add_bands,
    band_sums,
    long_gap_mask,
)
from allanite.summary.sums import Sum


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Column of a summary, or of a segment of it: octaves of its spectrum, and samples for the frequencies below them.

    `octaves` go from the highest frequency down. `samples` are at 2^−len(octaves) of the rate, NaN where too many are
    missing; `start` is the index of the first one, at their rate.
    """

    octaves: tuple[Octave, ...]
    samples: Array
    start: int

    __repr__ = brief

    @property
    def factor(self) -> int:
        """Sampling rate of the record divided by that of the kept `samples`: 2 to the number of octaves."""
        return 1 << len(self.octaves)


def read_column(levels: list[Level], depth: int | None = None) -> Reading:
    """`Reading` of one column from the levels of its stream segments, in time order; samples between segments are NaN.

    `depth` is the number of octaves. By default, it is the smallest depth at which every segment keeps all samples and the
    total is at most 2^19 samples.
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


def depth_of(level: Level) -> int:
    """Depth (number of halvings of the rate) of the first level, from `level` downwards, that keeps all its samples."""
    while not level.whole:
        assert level.deeper is not None
        level = level.deeper
    return level.depth


def read_segment(level: Level, depth: int) -> Reading:
    """`Reading` of a stream segment: power in `depth` octaves, and the samples after `depth` halvings of the rate.

    `level` is that at the full rate. `depth` must be at least `depth_of(level)`.
    """
    octaves = []
    before, after = np.zeros(0), np.zeros(0)
    here: Level | None = level
    start, samples = level.start, np.zeros(0)
    for at in range(depth + 1):
        if here is not None and not here.whole:
            assert here.tiles is not None
            head = np.concatenate([before, here.samples()])
            tail = np.concatenate([*here.tail, after])
            start = here.start - before.size
            tail_at = here.tiles[1] * TILE - MARGIN
            found = Octave(power=Sum.zeros(here.power.high.size))
            found.add(here)
            if at == depth:
                raise AssertionError("a level that keeps all samples was asked for")
            before = _halved_end(found, head, start, (True, False), here)
            after = _halved_end(found, tail, tail_at, (False, True), here)
            octaves.append(found)
            here = here.deeper
            continue
        middle = here.samples() if here is not None else np.zeros(0)
        if here is not None:
            start = here.start - before.size
        samples = np.concatenate([before, middle, after])
        if at == depth:
            break
        size = SEGMENT - LOW if at == 0 else LOW
        found = Octave(power=Sum.zeros(size))
        before = _halved_end(found, samples, start, (True, True), level)
        after, here = np.zeros(0), None
        start = (start + start % 2) // 2
        octaves.append(found)
    return Reading(tuple(octaves), samples, start)


def _halved_end(
    found: Octave, x: Array, start: int, record_ends: tuple[bool, bool], level: Level
) -> Array:
    """Array of `x`, the samples at one end of a level, at half the rate; adds the power of `x` to `found`.

    The result is NaN in long gaps, and everywhere if `x` is too short for the filter or all samples are missing. `x`
    begins at index `start`. `record_ends` says whether the record begins and ends with `x`. On any other side, `x` has
    `MARGIN` samples more than the result covers. Power is added only if `level.spectral` and the result covers at least
    `SEGMENT` samples of `x`.
    """
    if record_ends[0] and start % 2:
        x, start = x[1:], start + 1
    if record_ends[1] and (start + x.size) % 2:
        x = x[:-1]
    stop = start + x.size
    low = start if record_ends[0] else start + MARGIN
    high = stop if record_ends[1] else stop - MARGIN
    if high - low < 2 * REACH:
        return np.full(max(0, (high - low) // 2), np.nan)
    gaps = np.isnan(x)
    if gaps.all():
        return np.full((high - low) // 2, np.nan)
    filled = fill_missing(x)
    left = filled[REACH - 1 :: -1] if record_ends[0] else filled[MARGIN - REACH : MARGIN]
    right = (
        filled[: -REACH - 1 : -1]
        if record_ends[1]
        else filled[filled.size - MARGIN : filled.size - MARGIN + REACH]
    )
    half = halved(np.concatenate([left, filled[low - start : high - start], right]))
    if gaps.any():
        half[long_gap_mask(gaps[low - start : high - start])] = np.nan
    if level.spectral and high - low >= SEGMENT:
        _add_segments(found, filled, gaps, start, (low, high), record_ends)
    return half


def _add_segments(
    found: Octave,
    x: Array,
    gaps: NDArray[np.bool_],
    start: int,
    span: tuple[int, int],
    record_ends: tuple[bool, bool],
) -> None:
    """Add the power of the transform segments that lie within the indices `span` to `found`, in place.

    `x` are samples from index `start` on; `gaps` is True for those that were missing and filled. Transform segments
    with more than 1/8 filled samples are omitted. `record_ends` says whether the record begins and ends with the span.
    At such an end, a remainder of less than half a segment joins the segment beside it.
    """
    low, high = span
    borders = np.arange(-(-low // SEGMENT), high // SEGMENT + 1) * SEGMENT
    # Less than half a segment at an end of the record joins its neighbor.
    if record_ends[0]:
        borders = np.append(low, borders[borders >= low + SEGMENT // 2])
    if record_ends[1]:
        borders = np.append(borders[borders <= high - SEGMENT // 2], high)
    size = found.power.high.size
    for i, (a, b) in enumerate(itertools.pairwise(borders)):
        left, right = record_ends[0] and i == 0, record_ends[1] and i == borders.size - 2
        if gaps[a - start : b - start].mean() > 1.0 / 8.0:
            continue
        begin, end = a - (0 if left else MARGIN), b + (0 if right else MARGIN)
        block = transform_at_end(x[begin - start : end - start], left, right) ** 2
        power = (block if block.size == SEGMENT else resample_power(block))[LOW : LOW + size]
        frames = (b - a) / SEGMENT
        found.power.add(power)
        found.frames += frames
        add_bands(found, int((a + b) // 2 // TILE), band_sums(power[:LOW])[None], frames)

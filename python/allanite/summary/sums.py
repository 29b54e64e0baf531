"""Sums that do not depend on the order of addition: two doubles for each number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from allanite import _kernels
from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array


@align_when_unpickled
@dataclass(slots=True, eq=False)
class Sum:
    """Array of sums, stored as `high + low` with about 106 bits; the order of addition changes only the last few bits."""

    high: Array
    low: Array

    @classmethod
    def zeros(cls, shape: int | tuple[int, ...]) -> Sum:
        """`Sum` of the given shape with all values 0."""
        return cls(np.zeros(shape), np.zeros(shape))

    def add(self, value: Array, low: Array | float = 0.0) -> None:
        """Add the array `value`, and `low` as the digits below its precision (Knuth's two-sum), in place."""
        total = self.high + value
        back = total - self.high
        lost = (self.high - (total - back)) + (value - back)
        low_part = self.low + (lost + low)
        self.high = total + low_part
        self.low = low_part - (self.high - total)

    @property
    def value(self) -> Array:
        """Sums as a float64 array: high + low."""
        return self.high + self.low

    def state(self) -> dict[str, Any]:
        """Dict with the two arrays ``high`` and ``low`` whose sum is `value`."""
        return {"high": self.high, "low": self.low}


@align_when_unpickled
@dataclass(slots=True, eq=False)
class Blocks:
    """Map of power over time and frequency bands: sums of 2^size consecutive tiles, aligned to sample 0 of the stream.

    `first` is the index of the first block. `sums` has shape (blocks, bands). `frames` is the number of transform segments
    in each block. `size` grows so that there are at most `most` blocks.
    """

    size: int
    first: int
    sums: Sum
    frames: Array
    most: int

    @classmethod
    def empty(cls, bands: int, most: int) -> Blocks:
        """`Blocks`, a map of power over time and frequency, still empty: for `bands` bands and up to `most` time blocks."""
        return cls(0, 0, Sum.zeros((0, bands)), np.zeros(0), most)

    @classmethod
    def restored(cls, state: dict[str, Any], most: int) -> Blocks:
        """`Blocks` from the dict that `state()` returned; it will hold at most `most` time blocks."""
        sums = Sum(state["high"], state["low"])
        return cls(state["size"], state["first"], sums, state["frames"], most)

    def add(self, tile: int, power: Array, frames: float) -> None:
        """Add `power`, shape (tiles, bands), of tiles from index `tile` on, with `frames` transform segments each."""
        end = tile + power.shape[0]
        self._extend_to(tile >> self.size, ((end - 1) >> self.size) + 1)
        at = tile
        while at < end:
            block = at >> self.size
            until = min(end, (block + 1) << self.size)
            place = block - self.first
            rows = np.ascontiguousarray(power[at - tile : until - tile])
            _kernels.add_rows(self.sums.high[place], self.sums.low[place], rows)
            self.frames[place] += frames * (until - at)
            at = until

    def merge(self, other: Blocks) -> None:
        """Add the blocks of `other`, another segment of the same stream, in place.

        The finer of both is coarsened first, and the result until it has at most `most` blocks. An empty `other`
        changes nothing.
        """
        if other.frames.size == 0:
            return
        while self.size < other.size:
            self._coarsen()
        theirs = Blocks(other.size, other.first, other.sums, other.frames, self.most)
        while theirs.size < self.size:
            theirs._coarsen()
        self._extend_to(theirs.first, theirs.first + theirs.frames.size)
        while theirs.size < self.size:
            theirs._coarsen()
        place = slice(theirs.first - self.first, theirs.first - self.first + theirs.frames.size)
        part = Sum(self.sums.high[place], self.sums.low[place])
        part.add(theirs.sums.high, theirs.sums.low)
        self.sums.high[place], self.sums.low[place] = part.high, part.low
        self.frames[place] += theirs.frames

    def _extend_to(self, first: int, end: int) -> None:
        """Extend the map to the block indices first … end − 1, then coarsen it to at most `most` blocks."""
        if self.frames.size == 0:
            self.first = first
        low, high = min(first, self.first), max(end, self.first + self.frames.size)
        before, after = self.first - low, high - self.first - self.frames.size
        if before or after:
            old = self.sums
            bands = old.high.shape[1]
            here = slice(before, before + self.frames.size)
            self.sums = Sum.zeros((high - low, bands))
            self.sums.high[here], self.sums.low[here] = old.high, old.low
            frames = np.zeros(high - low)
            frames[here] = self.frames
            self.frames = frames
            self.first = low
        while self.frames.size > self.most:
            self._coarsen()

    def _coarsen(self) -> None:
        """Merge pairs of neighboring time blocks in place; a block without a neighbor is merged with an empty one."""
        count = self.frames.size
        odd = self.first % 2
        pad = ((odd, (odd + count) % 2), (0, 0))
        high, low = np.pad(self.sums.high, pad), np.pad(self.sums.low, pad)
        pair = Sum(high[0::2].copy(), low[0::2].copy())
        pair.add(high[1::2], low[1::2])
        self.sums = pair
        self.frames = np.pad(self.frames, pad[0]).reshape(-1, 2).sum(axis=1)
        self.first >>= 1
        self.size += 1

    def state(self) -> dict[str, Any]:
        """Dict of plain values and arrays from which `Blocks.restored` makes the same map of power."""
        return {"size": self.size, "first": self.first, "frames": self.frames, **self.sums.state()}

"""One level of the pyramid: samples at a rate, their power in transform segments, and the level at half the rate.

All work is done in tiles at fixed sample indices of the stream, so that results do not depend on the chunks. A stream
segment keeps the samples at its ends that its neighbors need to complete the tiles between them. The last level, which
is short, keeps all its samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array, runs_of
from allanite.common.showing import brief
from allanite.summary.gaps import fill_missing
from allanite.summary.lapped import LOW, REACH, SEGMENT, halved, kernel, segments
from allanite.summary.sums import Blocks, Sum

#: Number of samples of a tile, and number of samples on each side that its transform needs in addition.
TILE, MARGIN = 16384, SEGMENT // 2
#: Maximum number of samples of a level that keeps all its samples.
MAX_KEPT_SAMPLES = 1 << 18
#: Map of power over time: number of frequency bands of a level, and maximum number of time blocks.
BANDS, BLOCKS = 8, 512
#: The same of the fine map, in which moving bands are found.
FINE, SECTIONS = 38 * BANDS, 64
#: Transform segments with a larger share of missing samples are not used. Chosen by judgment; not measured.
MAX_MISSING_SHARE = 1.0 / 8.0


@dataclass(slots=True, eq=False, kw_only=True)
class Octave:
    """Power of one level, summed over `frames` transform segments, and in bands over time.

    `power` is that of the coefficients from `LOW` to twice `LOW`; on the first level to the last. `blocks` is the power
    over time in `BANDS`, `sections` in `FINE` bands.
    """

    power: Sum = field(default_factory=lambda: Sum.zeros(0))
    frames: float = 0.0
    blocks: Blocks = field(default_factory=lambda: Blocks.empty(BANDS, BLOCKS))
    sections: Blocks = field(default_factory=lambda: Blocks.empty(FINE, SECTIONS))

    __repr__ = brief

    def add(self, other: Octave) -> None:
        """Add the spectral power of `other`, another stream segment at this level, in place: in total and over time."""
        self.power.add(other.power.high, other.power.low)
        self.frames += other.frames
        self.blocks.merge(other.blocks)
        self.sections.merge(other.sections)


@align_when_unpickled
@dataclass(slots=True, eq=False)
class Level(Octave):
    """Level of a pyramid: samples `start` … `stop` − 1 of a stream at 2^−depth of its rate, or their power and ends.

    `head` holds the samples up to the margin of the first finished tile, all samples if no tile is finished. `tail` holds
    those from the margin of the last finished tile on. `tiles` are the first finished tile and the one after the last.
    Results do not depend on `threads`.
    """

    depth: int
    start: int
    stop: int
    spectral: bool = True
    head: list[Array] = field(default_factory=list)
    tail: list[Array] = field(default_factory=list)
    tiles: tuple[int, int] | None = None
    deeper: Level | None = None
    threads: int = 1

    def __post_init__(self) -> None:
        """Allocate the sums of power if none were given."""
        if self.power.high.size == 0:
            self.power = Sum.zeros(SEGMENT - LOW if self.depth == 0 else LOW)

    @property
    def whole(self) -> bool:
        """True if the level keeps all its samples."""
        return self.tiles is None

    def samples(self) -> Array:
        """Kept samples at the beginning: all if `whole`, else up to the margin of the first finished tile."""
        return _joined(self.head)

    def extend(self, *pieces: Array) -> None:
        """Append the samples that follow, in one or more arrays, to this level, and at half the rate to the deeper levels.

        A level with more than `MAX_KEPT_SAMPLES` samples keeps only those at both of its ends, and the power of the others.
        Kept samples are copied, because the caller may reuse the memory.
        """
        self.stop += sum(x.size for x in pieces)
        if not self.whole:
            assert self.tiles is not None
            if self.stop >= (self.tiles[1] + 1) * TILE + MARGIN:
                self.tail.extend(pieces[:-1])
                self._finish_tail(self.tiles[1], pieces[-1])
            else:
                self.tail.extend(x.copy() for x in pieces)
            return
        self.head.extend(x.copy() for x in pieces)
        if self.stop - self.start > MAX_KEPT_SAMPLES:
            first = -(-(self.start + MARGIN) // TILE)
            remaining = _joined(self.head)[first * TILE - MARGIN - self.start :]
            self.tiles, self.tail = (first, first), []
            # A copy: a view would keep all samples in memory.
            self.head = [_joined(self.head)[: first * TILE + MARGIN - self.start].copy()]
            self._finish_tail(first, remaining)

    def _finish_tail(self, tile: int, x: Array) -> None:
        """Halve the rate of all complete tiles from index `tile` on, in place; the samples are the tail followed by `x`.

        The remaining samples become the tail. The samples at half the rate are appended to the deeper level.
        """
        assert self.tiles is not None
        tail = _joined(self.tail)
        end = (self.stop - MARGIN) // TILE
        # Tiles that begin in the kept tail are concatenated; the others are used in place.
        parted = min(end, tile - (-tail.size // TILE))
        used = (parted - tile) * TILE + 2 * MARGIN - tail.size if parted < end else x.size
        runs = [(tile, np.concatenate([tail, x[:used]]))] if tail.size else []
        if parted < end:
            runs.append((parted, x[used - 2 * MARGIN :] if tail.size else x))
        halves = []
        # Without a run no tile is complete, and the tail is empty.
        remaining = x
        for first, run in runs:
            count = (run.size - 2 * MARGIN) // TILE
            halves.append(self.halve_tiles(first, run[: count * TILE + 2 * MARGIN]))
            remaining = run[count * TILE :]
        self.tiles, self.tail = (self.tiles[0], end), [remaining.copy()]
        if self.deeper is None and halves:
            start = tile * TILE // 2
            self.deeper = Level(self.depth + 1, start, start, self.spectral, threads=self.threads)
        if self.deeper is not None:
            self.deeper.extend(*halves)

    def halve_tiles(self, first: int, x: Array) -> Array:
        """Samples of consecutive tiles at half the rate, shape (n / 2,); adds their power to this level.

        `first` is the index of the first tile. `x` has `MARGIN` more samples than the tiles at both ends.
        """
        count = (x.size - 2 * MARGIN) // TILE
        out: list[Array] = []
        done = 0
        while done < count:
            if self.spectral:
                # The compiled loop uses all threads and stops at the first missing sample.
                half = np.empty((count - done) * TILE // 2)
                sums = LOW, self.power.high, self.power.low
                bands, taken = kernel().tiles(x[done * TILE :], half, sums, FINE, self.threads)
                if taken:
                    self.frames += 2.0 * taken
                    add_bands(self, first + done, bands.reshape(taken, FINE), 2.0)
                    out.append(half[: taken * TILE // 2])
                    done += taken
                    continue
            at = done * TILE
            half, power, frames = halve_tile(x[at : at + TILE + 2 * MARGIN], self.spectral)
            if frames:
                kept = power[LOW : LOW + self.power.high.size]
                self.power.add(kept)
                self.frames += frames
                add_bands(self, first + done, band_sums(kept[:LOW])[None], frames)
            out.append(half)
            done += 1
        return _joined(out)

    def state(self) -> dict[str, Any]:
        """Dict with this level and all deeper levels as plain values and arrays, which `restored` accepts."""
        return {
            "depth": self.depth,
            "start": self.start,
            "stop": self.stop,
            "spectral": self.spectral,
            "head": _joined(self.head),
            "tail": _joined(self.tail),
            "tiles": None if self.tiles is None else list(self.tiles),
            "power": self.power.state(),
            "frames": self.frames,
            "blocks": self.blocks.state(),
            "sections": self.sections.state(),
            "deeper": None if self.deeper is None else self.deeper.state(),
        }

    @classmethod
    def restored(cls, state: dict[str, Any]) -> Level:
        """`Level`, with its deeper levels, from the dict that `state()` returned.

        `sections`, the map of power in narrow bands, is empty if an old file has none.
        """
        sections = (
            Blocks.restored(state["sections"], SECTIONS)
            if "sections" in state
            else Blocks.empty(FINE, SECTIONS)
        )
        objects = {
            "head": [state["head"]],
            "tail": [state["tail"]],
            "tiles": state["tiles"] and tuple(state["tiles"]),
            "power": Sum(**state["power"]),
            "blocks": Blocks.restored(state["blocks"], BLOCKS),
            "sections": sections,
            "deeper": state["deeper"] and cls.restored(state["deeper"]),
        }
        return cls(**{**state, **objects})


def join_levels(left: Level, right: Level) -> Level:
    """`Level` that joins two adjacent levels of one depth; do not use `left` and `right` afterwards."""
    if right.whole:
        left.extend(right.samples())
        return left
    assert right.tiles is not None
    begin = left.start
    if not left.whole:
        assert left.tiles is not None
        begin = left.tiles[1] * TILE - MARGIN
    x = np.concatenate([_joined(left.head if left.whole else left.tail), right.samples()])
    first = -(-(begin + MARGIN) // TILE)
    between = x[first * TILE - MARGIN - begin : right.tiles[0] * TILE + MARGIN - begin]
    middle = Level(right.depth + 1, first * TILE // 2, first * TILE // 2, right.spectral)
    middle.extend(right.halve_tiles(first, between))
    deeper = [level for level in (left.deeper, middle, right.deeper) if level is not None]
    found = deeper[0]
    for level in deeper[1:]:
        found = join_levels(found, level)
    right.deeper = found
    if left.whole:
        right.head = [x[: first * TILE + MARGIN - begin]]
        right.tiles = first, right.tiles[1]
    else:
        assert left.tiles is not None
        right.head = left.head
        right.tiles = left.tiles[0], right.tiles[1]
        right.power.add(left.power.high, left.power.low)
        right.frames += left.frames
        left.blocks.merge(right.blocks)
        left.sections.merge(right.sections)
        right.blocks, right.sections = left.blocks, left.sections
    right.start = left.start
    return right


def halve_tile(x: Array, spectral: bool) -> tuple[Array, Array, float]:
    """Tuple (samples of one tile at half the rate, summed power of each coefficient, number of transform segments summed).

    `x` has `MARGIN` more samples than the tile at both ends. Samples in long gaps are NaN. Transform segments with more
    than 1/8 missing samples are not summed. Without `spectral`, or with fewer than 16 present samples, power and number are
    0.
    """
    gaps = np.isnan(x)
    lost = None
    if gaps.any():
        lost = gaps
        if gaps.sum() > gaps.size - 16:
            return np.full((x.size - 2 * MARGIN) // 2, np.nan), np.zeros(SEGMENT), 0.0
        x = fill_missing(x)
    half = halved(x[MARGIN - REACH : x.size - MARGIN + REACH])
    if lost is not None:
        half[long_gap_mask(lost[MARGIN : x.size - MARGIN])] = np.nan
    if not spectral:
        return half, np.zeros(SEGMENT), 0.0
    # A large offset would leak, so the mean of the tile is subtracted.
    found = segments(x - x.mean())
    if lost is not None:
        share = lost[MARGIN : x.size - MARGIN].reshape(-1, SEGMENT).mean(axis=1)
        found = found[share <= MAX_MISSING_SHARE]
    np.square(found, out=found)
    return half, found.sum(axis=0), float(found.shape[0])


def long_gap_mask(gaps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask of shape (n / 2,), one per pair of samples: True in runs of more than `MARGIN` pairs with both missing."""
    pairs = gaps[0::2] & gaps[1::2]
    out = np.zeros(pairs.size, dtype=bool)
    for start, end in zip(*runs_of(pairs), strict=True):
        out[start:end] = end - start > MARGIN
    return out


def add_bands(to: Octave, tile: int, power: Array, frames: float) -> None:
    """Add `power`, shape (tiles, `FINE`), of consecutive tiles to both maps of power over time of `to`, in place.

    `tile` is the index of the first tile, `frames` the number of transform segments per tile.
    """
    to.blocks.add(tile, power.reshape(power.shape[0], BANDS, -1).sum(axis=2), frames)
    to.sections.add(tile, power, frames)


def band_sums(power: Array) -> Array:
    """Power of an octave, given that of its coefficients, in each of `FINE` consecutive bands, shape (FINE,)."""
    return np.add.reduceat(power, [power.size * band // FINE for band in range(FINE)])


def _joined(parts: list[Array]) -> Array:
    """Array: concatenation of `parts`, empty for an empty list. Side effect: the list then holds only this array."""
    if len(parts) != 1:
        parts[:] = [np.concatenate(parts)] if parts else [np.zeros(0)]
    return parts[0]

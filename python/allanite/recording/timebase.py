"""Time base: sampling rate and regular grid from time stamps, with counts of all irregularities."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.recording.stamp_units import (
    TIME_UNITS,
    stamp_numbers,
    unit_of_stamps,
    unusable_stamps,
)
from allanite.recording.steps import NO_STEADY_RATE, Steps

#: Maximum number of missing samples per present sample of one segment.
MAX_MISSING_RATIO = 4
#: Minimum gap that splits a record, samples: a record with every tenth sample is sparse, not split.
MIN_SPLITTING_GAP = 64
#: Minimum ratio of the standard deviation of the spacing to the interval for which samples keep their own times. There a
#: random walk, whose step grows with the spacing, differs by 1 % from one on a grid.
MIN_UNEVENNESS = 0.01
#: Maximum number of samples of a recording that keeps their times.
MAX_KEPT_TIMES = 1 << 20


@dataclass(frozen=True, slots=True)
class Stamps:
    """Properties of a time column.

    Attributes
    ----------
    rate : float
        Samples per second, without long gaps.
    unit : str
        Unit of the column: s, ms, us, ns, min, h or d.
    unit_source : str
        How the unit is known: ``"given"``, or a guess by ``"rate"`` (the one stated), ``"epoch"``
        (seconds since 1970 of this century), ``"usual"`` (fractions of a second) or ``"size"``.
    n : int
        Number of stamps.
    jitter : float
        Standard deviation of the spacing without gaps, s.
    resolution : float
        Smallest positive step of the stamps, s.
    duplicates, backwards : int
        Stamps equal to, or earlier than, the one before.
    first_duplicate, first_backwards : int
        Rows of the first of these, counted from 0, or −1.
    gaps : tuple of (int, int)
        (row after which samples are missing, number missing); one is put at a seam.
    coarse : bool
        True if several samples share a stamp (whole seconds of a 5 Hz log), so that short gaps cannot be found.
    lost : bool
        True if jitter is as large as the interval, or samples come in bursts, so that only long gaps can be found.
    seams : tuple of (int, float)
        (row after which time runs back permanently, by how many s): joined logs, or a clock set back.
    wraps : tuple of int
        Rows after which a counter restarted.
    wrap : float
        Span of that counter, s.
    drift : float
        Largest mean interval of 16 segments over the smallest, less 1; 0 if within jitter.
    changed : int
        Row about which the rate changes by more than 2 %, or −1.
    pieces : tuple of (int, int)
        First row and end (exclusive) of each segment between gaps that are too long to fill.
    piece : int
        Index of the segment that is used.
    """

    rate: float
    unit: str
    unit_source: str
    n: int
    jitter: float
    resolution: float
    duplicates: int
    backwards: int
    first_backwards: int
    gaps: tuple[tuple[int, int], ...]
    coarse: bool
    first_duplicate: int = -1
    lost: bool = False
    seams: tuple[tuple[int, float], ...] = ()
    wraps: tuple[int, ...] = ()
    wrap: float = 0.0
    drift: float = 0.0
    changed: int = -1
    pieces: tuple[tuple[int, int], ...] = ()
    piece: int = 0

    __repr__ = brief

    @property
    def guessed(self) -> bool:
        """True if the unit is a guess from the magnitude of the numbers alone."""
        return self.unit_source == "size"

    @property
    def missing(self) -> int:
        """Number of samples that are missing in all gaps of the log together."""
        return sum(count for _, count in self.gaps)

    @property
    def rows(self) -> tuple[int, int]:
        """Tuple (first row, end) of the segment used, `end` exclusive; the whole log without segments."""
        return self.pieces[self.piece] if self.pieces else (0, self.n)

    @property
    def gaps_in_segment(self) -> tuple[tuple[int, int], ...]:
        """Tuple of the gaps within the segment used, each (row after which samples are missing, number missing)."""
        first, end = self.rows
        return tuple((row, count) for row, count in self.gaps if first <= row < end - 1)


#: Limit of the steps of damaged stamps, so that squares and ratios do not overflow; steps below its reciprocal count as 0.
MAX_STEP = 1e140


def read_stamps(
    time: ArrayLike, unit: str | None = None, rate: float | None = None, piece: int | None = None
) -> Stamps:
    """`Stamps`: rate, unit, gaps and irregularities of a time column of numbers or date-times.

    The unit is guessed if it is not given; the stated `rate` (Hz) helps. `piece`, counted from 1, is the segment to use if
    very long gaps split the record; by default the one with most samples. Raises `InputError` for fewer than two stamps,
    stamps that are not finite, do not advance, or have no identifiable unit, and for an unknown segment.
    """
    t, unit = stamp_numbers(time, unit)
    sums = StampSums(unit, rate)
    steps = sums.add(t, 0, t.size)
    stamps = sums.stamps(piece)
    if steps.coarse or steps.lost:
        return stamps
    regular = np.setdiff1d(np.arange(steps.raw.size), [row for row, _ in steps.gaps])
    clean = steps.clean[regular] * TIME_UNITS[stamps.unit]
    drift, changed = _interval_drift(clean, stamps.jitter, stamps.resolution)
    return replace(stamps, drift=drift, changed=int(regular[changed]) if changed >= 0 else -1)


class StampSums:
    """Sums over the intervals between time stamps that are added in chunks; `unit` and `rate` as in `read_stamps`."""

    def __init__(self, unit: str | None, rate: float | None) -> None:
        if unit is not None and unit not in TIME_UNITS:
            raise InputError(f"unknown unit of time {unit!r}: one of {', '.join(TIME_UNITS)}")
        self.unit, self.rate = unit, rate
        self.unit_source = "given"
        self.rows = self.duplicates = self.backwards = 0
        self.first_duplicate = self.first_backwards = -1
        self.counts = self.times = self.squares = self.wrap = 0.0
        self.resolution = math.inf
        self.gaps: list[tuple[int, int]] = []
        self.seams: list[tuple[int, float]] = []
        self.wraps: list[int] = []
        self.coarse = self.lost = False

    def add(self, t: NDArray[Any], begun: int, end: int) -> Steps:
        """Add the stamps `t` from index `begun` to `end` to all sums; return the `Steps` of all of `t`.

        Stamps outside this range are only neighbors. The first call sets the unit.
        """
        before = self.rows - begun
        self.rows += end - begun
        # Differences before the conversion to float keep nanoseconds since 1970 exact.
        with np.errstate(over="ignore"):
            raw = np.clip(np.diff(t).astype(np.float64), -MAX_STEP, MAX_STEP)
        raw[np.abs(raw) < 1.0 / MAX_STEP] = 0.0
        steps = Steps(raw, t)
        if self.unit is None:
            self.unit, self.unit_source = unit_of_stamps(t, 1.0 / steps.rate, self.rate)
        second = TIME_UNITS[self.unit]
        self.coarse |= steps.coarse
        self.lost |= steps.lost
        first, last = max(begun - 1, 0), end - 1
        raw = raw[first:last]
        self.gaps += [(before + row, missing) for row, missing in steps.gaps if first <= row < last]
        self.counts += float(steps.counts[first:last].sum())
        self.times += float(steps.times[first:last].sum())
        self.resolution = min(self.resolution, float(raw[raw > 0].min(initial=math.inf)))
        here = [row for row in steps.wraps if first <= row < last]
        self.wraps += [before + row for row in here]
        self.wrap = max(self.wrap, steps.wrap * second * bool(here))
        seams = [row for row in steps.seams if first <= row < last]
        self.seams += [(before + row, -float(steps.raw[row]) * second) for row in seams]
        equal = np.flatnonzero(raw == 0)
        back = np.setdiff1d(np.flatnonzero(raw < 0), np.array(here, int) - first)
        if equal.size and not self.duplicates:
            self.first_duplicate = before + first + int(equal[0]) + 1
        if back.size and not self.backwards:
            self.first_backwards = before + first + int(back[0]) + 1
        self.duplicates += int(equal.size)
        self.backwards += int(back.size)
        regular = np.ones(steps.raw.size, dtype=bool)
        regular[[row for row, _ in steps.gaps]] = False
        clean = steps.clean[first:last][regular[first:last]]
        self.squares += float(np.var(clean)) * raw.size if clean.size else 0.0
        return steps

    def stamps(self, piece: int | None) -> Stamps:
        """`Stamps` of all stamps, without drift. Raises `InputError` if they do not advance, or for an unknown segment."""
        if not self.times > 0.0:
            raise unusable_stamps(NO_STEADY_RATE)
        second = TIME_UNITS[self.unit or "s"]
        pieces = segments_between_gaps(self.rows, self.gaps)
        return Stamps(
            rate=self.counts / self.times / second,
            unit=self.unit or "s",
            unit_source=self.unit_source,
            n=self.rows,
            jitter=math.sqrt(self.squares / max(self.rows - 1, 1)) * second,
            resolution=self.resolution * second,
            duplicates=self.duplicates,
            backwards=self.backwards,
            first_backwards=self.first_backwards,
            gaps=tuple(self.gaps),
            coarse=self.coarse,
            first_duplicate=self.first_duplicate,
            lost=self.lost,
            seams=tuple(self.seams),
            wraps=tuple(self.wraps),
            wrap=self.wrap,
            pieces=pieces,
            piece=index_of_segment(pieces, piece),
        )


def _interval_drift(steps: Array, jitter: float, resolution: float) -> tuple[float, int]:
    """Largest mean interval of 16 parts over the smallest, minus 1, and the index of the step where it changes most.

    The drift is 0 below 5·10⁻⁵, within the jitter, and for fewer than 800 steps. The index is −1 unless the drift exceeds
    2 %.
    """
    blocks = 16
    length = steps.size // blocks
    if length < 50:
        return 0.0, -1
    mean = steps[: length * blocks].reshape(blocks, length).mean(axis=1)
    # The mean of consecutive steps is the difference of two stamps: white jitter and rounding of both.
    noise = (jitter + resolution * (resolution < 0.5 * mean.mean())) / length
    change = float(mean.max() / mean.min() - 1)
    if change < 5e-5 or mean.max() - mean.min() < 6 * noise:
        return 0.0, -1
    worst = int(np.argmax(np.abs(np.diff(mean))))
    return change, (worst + 1) * length if change > 0.02 else -1


def segments_between_gaps(n: int, gaps: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """First row and end (exclusive) of each segment between gaps that are too long to fill.

    The longest gaps split the record, until in each segment at most four times as many samples are missing as present.
    Gaps below `MIN_SPLITTING_GAP` samples never split.
    """
    if sum(count for _, count in gaps) <= MAX_MISSING_RATIO * n:
        return ((0, n),)
    rows = np.array([row for row, _ in gaps])
    counts = np.array([count for _, count in gaps], dtype=np.float64)
    limit = float(counts.max())
    if limit < MIN_SPLITTING_GAP:
        return ((0, n),)
    while True:
        limit /= 2
        cuts = rows[counts > limit] + 1
        starts, ends = np.concatenate(([0], cuts)), np.concatenate((cuts, [n]))
        kept = counts <= limit
        inside = np.bincount(
            np.searchsorted(cuts, rows[kept], side="right"), counts[kept], minlength=starts.size
        )
        if np.all(inside <= MAX_MISSING_RATIO * (ends - starts)) or limit < MIN_SPLITTING_GAP:
            return tuple(zip(starts.tolist(), ends.tolist(), strict=True))


def index_of_segment(pieces: tuple[tuple[int, int], ...], piece: int | None) -> int:
    """Index, from 0, of the segment with the number `piece`, counted from 1; by default of the longest segment.

    Raises `InputError` for an unknown number.
    """
    if piece is None:
        return int(np.argmax([end - first for first, end in pieces]))
    if not 1 <= piece <= len(pieces):
        raise InputError(
            f"piece {piece}: the time column has {len(pieces)} segment{'s' * (len(pieces) > 1)},"
            f" counted from 1"
        )
    return piece - 1


def fill_gaps(array: NDArray[np.generic], stamps: Stamps) -> NDArray[np.generic]:
    """Rows of `array` in the segment used, with rows of NaN in place of missing samples.

    The result is a new array in double precision if samples are missing; otherwise it is the array or a view of it.
    """
    first, end = stamps.rows
    if end - first < len(array):
        array = array[first:end]
    gaps = stamps.gaps_in_segment
    if not gaps:
        return array
    rows = np.repeat([after + 1 - first for after, _ in gaps], [count for _, count in gaps])
    with np.errstate(invalid="ignore"):  # a NaN that signals is one like others
        return np.insert(array.astype(np.float64), rows, np.nan, axis=0)


def uneven_times(time: ArrayLike, stamps: Stamps) -> Array | None:
    """Time of each row since the first row used, s, shape (rows,), for unevenly spaced stamps; else None.

    Rows of missing samples have times between those of their neighbors. None if the jitter is at most 1 % of the
    interval, for more than 2^20 rows, and for stamps that run back.
    """
    first, end = stamps.rows
    if (
        stamps.jitter * stamps.rate <= MIN_UNEVENNESS
        or end - first > MAX_KEPT_TIMES
        or stamps.seams
    ):
        return None
    t, _ = stamp_numbers(time, stamps.unit)
    seconds = (t[first:end] - t[first]).astype(np.float64) * TIME_UNITS[stamps.unit]
    if (np.diff(seconds) < 0.0).any():
        return None
    missing = np.zeros(end - first, dtype=np.int64)
    for after, count in stamps.gaps_in_segment:
        missing[after + 1 - first] += count
    rows = np.arange(end - first) + np.cumsum(missing)
    return np.interp(np.arange(rows[-1] + 1), rows, seconds)


def epoch_of(time: ArrayLike, stamps: Stamps) -> float | None:
    """Time of the first row used, s since 1970, for date-times and decimal years (1900 to 2200); else None."""
    t, unit = stamp_numbers(time, None)
    first = float(t[stamps.rows[0]])
    if unit == "ns" and np.asarray(time).dtype.kind != "m":
        return first * 1e-9
    if stamps.unit == "y" and 1900.0 <= first <= 2200.0:
        return (first - 1970.0) * TIME_UNITS["y"]
    return None

"""Steps between time stamps: the usual step, counters that wrap, disorder, seams, missing samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.recording.stamp_units import unusable_stamps

#: Spans after which counters restart, in their own unit.
_BINARY = tuple(2.0**bits * scale for bits in (16, 32) for scale in (1.0, 1e-3, 1e-6))
#: A day, a GPS week, and a second, in each unit: counters with these spans restart at 0.
_DECIMAL = (1e6, 1e9, *(s * u for s in (86400.0, 604800.0) for u in (1.0, 1e3, 1e6, 1e9)))
#: Maximum number of rows of stamps that are out of order or damaged, after which time continues as usual.
MAX_DISORDER_ROWS = 16
#: Maximum number of events of disorder; with more the column is not a time.
MAX_EVENTS = 20_000
#: Maximum number of missing samples of one gap.
MAX_MISSING = 1e18
#: Samples before and after a late stamp whose earliest arrivals show whether samples are missing.
COMPARED_SAMPLES = 1024
#: Maximum number of missing samples of a gap that is used in the estimate of the rate.
MAX_SHORT_GAP = 32


def usual_step(steps: Array) -> float:
    """Usual step of time stamps: the median of the positive steps, or a mean or a fraction of the median in special cases.

    The median is the mode of nearly every log, and robust against jitter. For regular stamps that are rounded about as
    coarsely as their interval, the mean step is returned. If most samples are missing, the median is a multiple of the
    usual step. A fraction (1/2 to 1/5) of the median is taken if one step in eight is that short, and most steps are
    multiples of it. Raises `InputError` if no step is positive.
    """
    forward = steps[steps > 0]
    if forward.size == 0:
        raise unusable_stamps("the time column does not advance")
    middle = float(np.median(forward))
    rounded = _mean_of_rounded_steps(steps, middle)
    if rounded:
        return rounded
    some = forward[:: max(forward.size // 100_000, 1)]
    for parts in (2, 3, 4, 5):
        step = middle / parts
        near = some[np.abs(some / step - 1) < 0.1]
        if near.size < some.size / 8:
            continue
        step = float(np.median(near))
        ratio = some[some < 20 * step] / step
        if np.mean(np.abs(ratio - np.rint(ratio)) < 0.1) > 0.8:
            return step
    return middle


def _mean_of_rounded_steps(steps: Array, middle: float) -> float:
    """Mean step of regular stamps rounded about as coarsely as their interval (1, 2, 2, 1, … ms); 0 for other stamps.

    The sum of such steps stays within one step of a straight line. With randomly missing samples the sum would stray
    farther. 0 also for fewer than 200 steps.
    """
    length = 200
    if steps.size < length:
        return 0.0
    starts = np.linspace(0, steps.size - length, 9).astype(np.int64)
    some = np.stack([steps[at : at + length] for at in starts])
    mean = some.mean(axis=1)
    strays = np.ptp(np.cumsum(some - mean[:, np.newaxis], axis=1), axis=1)
    usual = float(np.median(mean))
    near = abs(usual / middle - 1) < 0.6
    return usual if near and float(np.median(strays)) < 1.2 * middle else 0.0


#: Problem of stamps without a rate.
NO_STEADY_RATE = "the time column nowhere advances at a steady rate"


@dataclass(slots=True)
class Steps:
    """Steps between stamps, separated into usual steps and irregularities.

    Attributes
    ----------
    raw, stamps : ndarray of shape (n − 1,) and (n,)
        Differences of the stamps, and the stamps, in their own unit.
    clean : ndarray of shape (n − 1,)
        Steps without wraps, with disorder and seams replaced by usual steps.
    usual : float
        The usual step; for shared stamps, their span over their number.
    wrap, wraps : float, list of int
        Span of a counter that restarts, and the rows before each restart.
    disorder : list of (int, int)
        First and last row of stamps that are not in order, after which time continues as usual.
    seams : list of int
        Rows after which time runs back permanently: joined logs.
    coarse, lost : bool
        True if several samples share a stamp; if gaps cannot be distinguished from jitter.
    gaps : list of (int, int)
        (row after which samples are missing, number missing); 1 at a seam.
    counts, times : ndarray of shape (n − 1,)
        Samples and time of each step, if both are known; the rate is the ratio of their sums.
    """

    raw: Array
    stamps: NDArray[Any]
    clean: Array = field(init=False)
    usual: float = field(init=False)
    wrap: float = 0.0
    wraps: list[int] = field(default_factory=list)
    disorder: list[tuple[int, int]] = field(default_factory=list)
    seams: list[int] = field(default_factory=list)
    coarse: bool = False
    lost: bool = False
    gaps: list[tuple[int, int]] = field(default_factory=list)
    counts: Array = field(init=False)
    times: Array = field(init=False)

    def __post_init__(self) -> None:
        """Compute all attributes from the steps `raw`; InputError for stamps that are not the times of a steady record."""
        self.clean = self.raw.copy()
        self.usual = usual_step(self.raw)
        self.counts = np.ones(self.raw.size)
        self._undo_wraps()
        self._replace_disorder()
        self._require_constant_interval()
        self.times = self.clean.copy()
        forward = np.count_nonzero(self.clean > 0)
        self.coarse = bool(forward < 0.7 * self.clean.size)
        if self.coarse:
            self._set_gaps_of_shared_stamps()
        else:
            self._set_gaps_of_single_stamps()
        self.gaps = sorted([*self.gaps, *((row, 1) for row in self.seams)])

    @property
    def rate(self) -> float:
        """Number of samples per unit of the stamps. Raises `InputError` if the stamps nowhere advance steadily."""
        span = float(self.times.sum())
        if not span > 0.0:
            raise unusable_stamps(NO_STEADY_RATE)
        return float(self.counts.sum()) / span

    def _exclude_from_rate(self, rows: NDArray[np.int64]) -> None:
        """Set `counts` and `times` of the steps after these rows to 0, so that the rate ignores them."""
        self.counts[rows] = self.times[rows] = 0.0

    def _undo_wraps(self) -> None:
        """Add the span of a counter, such as 2¹⁶ or a day, to its wraps in `clean`; set `wrap` and `wraps`.

        Nothing changes if no usual span fits.
        """
        back = np.flatnonzero(self.raw < -20 * self.usual)
        if back.size == 0:
            return
        low, high = float(self.stamps.min()), float(self.stamps.max())
        late = float(self.stamps[0]) > 100 * self.usual
        for span in (*_BINARY, *(_DECIMAL if late else ())):
            forward = self.raw[back] + span
            if not any(base <= low and high <= base + span for base in (0.0, -span / 2)):
                continue
            # The end of a counter may lie in a gap of up to a thousandth of its span; joined logs rarely look like that.
            most = max(3 * self.usual, span / 1000 if span in _BINARY else 0.0)
            if 0.3 * self.usual < float(np.median(forward)) < most and forward.min() > 0:
                self.clean[back] = forward
                self.wrap, self.wraps = span, back.tolist()
                return

    def _replace_disorder(self) -> None:
        """Replace steps that run back, and their neighbors, by usual steps in `clean`; set `disorder`, `seams` and `lost`.

        If over 1 % of the steps, and more than 5, run back, only those of over 100 usual steps are replaced. Raises
        `InputError` for more than 20 000 of them.
        """
        back = np.flatnonzero(self.clean < 0)
        if back.size > max(0.01 * self.clean.size, 5):
            # Jitter larger than the interval is not disorder; only a step far beyond it is a seam.
            self.lost = True
            back = back[self.clean[back] < -100 * self.usual]
        if back.size > MAX_EVENTS:
            raise unusable_stamps(
                f"the time column runs back {back.size} times, first after row {int(back[0])}: no"
                " time stamps, or a counter"
            )
        done = -1
        for i in back.tolist():
            if i < done:
                continue
            place = self._disorder_around(i)
            if place is None:
                self.seams.append(i)
                self.clean[i] = self.usual
            else:
                first, end = place
                self.disorder.append((first + 1, end - 1))
                mean = float(self.clean[first:end].sum()) / (end - first)
                # A huge stamp removes the digits of the others.
                self.clean[first:end] = mean if 0.5 < mean / self.usual < 1.5 else self.usual
                done = end

    def _disorder_around(self, i: int) -> tuple[int, int] | None:
        """Shortest run (first, end) of steps with step i that restores the usual advance; end exclusive.

        None if no run of up to 16 steps does this, because time runs back for good, as in joined logs.
        """
        low = max(i - MAX_DISORDER_ROWS, 0)
        sums = np.concatenate(([0.0], np.cumsum(self.clean[low : i + MAX_DISORDER_ROWS])))
        starts, ends = np.arange(low, i + 1), np.arange(i + 1, low + sums.size)
        width = ends[np.newaxis, :] - starts[:, np.newaxis]
        total = sums[ends - low][np.newaxis, :] - sums[starts - low][:, np.newaxis]
        scale = 1e-12 * float(np.abs(sums).max())
        fits = (np.abs(total - width * self.usual) <= 0.6 * self.usual + scale) & (
            width <= MAX_DISORDER_ROWS
        )
        if not fits.any():
            return None
        at = np.argmin(np.where(fits, width, MAX_DISORDER_ROWS + 1))
        row, column = np.unravel_index(at, fits.shape)
        return int(starts[row]), int(ends[column])

    def _require_constant_interval(self) -> None:
        """Raise `InputError` if the interval of the stamps changes for good by over 30 %, as in joined recordings.

        The usual steps of 16 blocks are compared. Nothing is raised for fewer than 1600 steps, or if the interval
        changes more than three times.
        """
        blocks = 16
        length = self.clean.size // blocks
        if length < 100:
            return
        parts = self.clean[: length * blocks].reshape(blocks, length)
        usual = [usual_step(part) if (part > 0).any() else np.inf for part in parts]
        low, high = int(np.argmin(usual)), int(np.argmax(usual))
        if not 1.3 * usual[low] < usual[high] < np.inf:
            return
        middle = float(np.sqrt(usual[low] * usual[high]))
        slow = np.array(usual) > middle
        changes = np.flatnonzero(np.diff(slow))
        if changes.size > 3:
            return
        row = (int(changes[0]) + 1) * length
        raise unusable_stamps(
            f"the interval of the time stamps changes from {usual[0]:.4g} to"
            f" {usual[-1] if slow[0] != slow[-1] else usual[high]:.4g} (of the stamps' unit) about row"
            f" {row}: the log contains two recordings; split it there",
            ", or ",
        )

    # -- stamps of single samples -----------------------------------------------------------------

    def _set_gaps_of_single_stamps(self) -> None:
        """Set `usual`, `lost`, `gaps`, `counts` and `times`, for stamps that each belong to one sample.

        Steps over 1.5 usual intervals are gaps. Gaps cannot be told from jitter if more than 5 % of the steps are that
        long, and not by whole samples. Then, and if `lost` was already True, only steps over 20 usual intervals and 20
        mean steps are gaps.
        """
        steps = self.clean
        for _ in range(3):
            ratio = steps / self.usual
            near = steps[(ratio > 0.5) & (ratio < 1.5)]
            if near.size == 0:  # no step has the usual interval after the repairs
                break
            usual = float(np.mean(near))
            if abs(usual / self.usual - 1) < 1e-9:
                break
            self.usual = usual
        steps, usual = self.clean, self.usual
        late = np.flatnonzero(steps > 1.5 * usual)
        if self.lost or (
            late.size > 0.05 * steps.size and not self._are_late_by_whole_samples(late)
        ):
            # Bursts, or jitter as large as the interval, say nothing about single samples.
            self.lost = True
            late = late[steps[late] > max(20 * usual, 20 * float(np.mean(steps)))]
            late = late[~self._is_delay_caught_up(late)]
            self._exclude_from_rate(late)
            missing = np.rint(np.minimum(steps[late] * self.rate, MAX_MISSING)) - 1
            self.gaps = list(zip(late.tolist(), missing.astype(np.int64).tolist(), strict=True))
            return
        self._count_missing(late)

    def _is_delay_caught_up(self, late: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Mask of the long steps with the indices `late` after which samples only came late, so that none is missing.

        The delays of stamps behind evenly spaced ones are compared: the smallest among 1024 stamps before the step, and
        among 1024 after it. True if the smallest delay grows by less than half of the step.
        """
        steps = self.clean
        step = (float(steps.sum()) - float(steps[late].sum())) / max(steps.size - late.size, 1)
        delay = np.concatenate([[0.0], np.cumsum(steps - step)])

        def earliest(first: int, end: int) -> float:
            """Smallest delay of the stamps first … end − 1 behind evenly spaced ones, in the unit of the stamps."""
            return float(delay[max(first, 0) : end].min())

        return np.array(
            [
                earliest(i + 1, i + 1 + COMPARED_SAMPLES)
                - earliest(i + 1 - COMPARED_SAMPLES, i + 1)
                < 0.5 * steps[i]
                for i in late.tolist()
            ],
            dtype=bool,
        )

    def _are_late_by_whole_samples(self, late: NDArray[np.int64]) -> bool:
        """True if the steps after the rows `late` are multiples of the usual step, and not the pauses between packets.

        Pauses between packets of samples recur at even distances, and are longer than three usual steps.
        """
        ratio = self.clean[late] / self.usual
        short = ratio[ratio < 20]
        if short.size and np.median(np.abs(short - np.rint(short))) > 0.1:
            return False
        apart = np.diff(late)
        periodic = apart.size > 3 and np.ptp(np.quantile(apart, [0.1, 0.9])) <= 0.2 * np.median(
            apart
        )
        return not (periodic and np.median(ratio) > 3)

    def _count_missing(self, late: NDArray[np.int64]) -> None:
        """Set `gaps`, `counts` and `times` from the steps after the rows `late`.

        Short gaps are counted by the typical step, gaps of more than 32 samples by the rate.
        """
        steps, usual = self.clean, self.usual
        alone = np.rint(steps[late] / usual) - 1
        # A late stamp next to an early one is jitter; after a gap, time does not catch up.
        total = np.concatenate(([0.0], np.cumsum(np.minimum(steps, 1e6 * usual))))
        low, high = np.maximum(late - 1, 0), np.minimum(late + 3, steps.size)
        around = np.rint((total[high] - total[low]) / usual) - (high - low)
        missing = np.where(alone < 3, np.minimum(alone, around), alone)
        late, missing = late[missing >= 1], missing[missing >= 1]
        short = missing <= MAX_SHORT_GAP
        self.counts[late] += missing
        self._exclude_from_rate(np.concatenate((late[~short], self.seams)).astype(np.int64))
        missing[~short] = np.rint(np.minimum(steps[late[~short]] * self.rate, MAX_MISSING)) - 1
        self.gaps = list(zip(late.tolist(), missing.astype(np.int64).tolist(), strict=True))

    # -- stamps that several samples share --------------------------------------------------------

    def _set_gaps_of_shared_stamps(self) -> None:
        """Set `gaps`, `counts` and `times`, for stamps that several samples share, such as whole seconds of a 5 Hz log.

        A gap is a step of more than (2.5 + 2/n) usual steps, where n is the mean number of samples per stamp.
        """
        at = np.flatnonzero(self.clean > 0)
        steps = self.clean[at]
        unit = self.usual
        rows = np.diff(at)
        each = float(np.mean(rows)) if rows.size else float(self.clean.size)
        # Two stamps without a sample may be chance if there is about one sample per stamp.
        holes = steps > (2.5 + 2 / each) * unit
        late = at[holes]
        self.times[late] = 0.0
        # A run of samples begins and ends within a stamp, so only whole stamps between are counted.
        self.counts[late] = 1.0 - each
        missing = np.rint(np.minimum((steps[holes] - unit) * self.rate, MAX_MISSING)).astype(
            np.int64
        )
        self.gaps = [(i, k) for i, k in zip(late.tolist(), missing.tolist(), strict=True) if k >= 1]

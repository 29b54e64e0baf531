"""Stream segment: pyramid, Allan curve and extremes of every column of consecutive samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.deviation.accumulator import Accumulator
from allanite.summary.level import Level, join_levels
from allanite.summary.sums import Sum

#: Number of averaging times per octave of the Allan curve.
TAUS_PER_OCTAVE = 2
#: Number of samples processed at a time, so that they stay in the cache.
SAMPLES_AT_ONCE = 1 << 16


@dataclass(slots=True, eq=False)
class Extremes:
    """Counts, extremes and moments of the differences of consecutive samples of a column.

    `low` and `high` are the smallest and largest sample and its index in the stream. `steps`, shape (4,), are the number of
    differences d of neighbors, number of zeros among them, Σd², Σd⁴. `ends` are the first and last sample; NaN if missing.
    """

    count: int = 0
    missing: int = 0
    gaps: int = 0
    low: tuple[float, int] = (np.inf, -1)
    high: tuple[float, int] = (-np.inf, -1)
    steps: Sum = field(default_factory=lambda: Sum.zeros(4))
    ends: tuple[float, float] | None = None

    def update(self, x: Array, at: int) -> None:
        """Add consecutive samples in place; `at` is the index of the first one in its stream.

        NaN counts as missing, and a run of NaN as one gap. Equal extremes keep the first index.
        """
        before = None if self.ends is None else self.ends[1]
        low, high, *moments = _kernels.steps(x)
        if np.isnan(moments[1]) or np.isnan(x[0]):
            holes = np.isnan(x)
            lost = int(np.count_nonzero(holes))
            was = False if before is None else bool(np.isnan(before))
            self.gaps += int(np.count_nonzero(holes & ~np.concatenate([[was], holes[:-1]])))
            self.missing += lost
            self.count -= lost
            self._add_steps(x[1:] - x[:-1])
        else:
            self.steps.add(np.array([x.size - 1, *moments], dtype=np.float64))
        self.count += x.size
        # The index is searched only for a new extreme.
        if low < self.low[0]:
            self.low = low, at + int(np.flatnonzero(x == low)[0])
        if high > self.high[0]:
            self.high = high, at + int(np.flatnonzero(x == high)[0])
        if before is not None:
            self._add_steps(np.array([x[0] - before]))
        self.ends = float(x[0]) if self.ends is None else self.ends[0], float(x[-1])

    def _add_steps(self, d: Array) -> None:
        """Add the differences d of neighboring samples to `steps` in place; NaN are ignored."""
        if d.size and np.isnan(d.sum()):
            d = d[~np.isnan(d)]
        square = d * d
        found = [d.size, d.size - np.count_nonzero(d), square.sum(), (square * square).sum()]
        self.steps.add(np.array(found, dtype=np.float64))

    def merge(self, other: Extremes) -> None:
        """Add `other`, the segment that follows this one, in place; of equal extremes the first stays."""
        if other.ends is None:
            return
        if self.ends is not None:
            self.gaps -= bool(np.isnan(self.ends[1]) and np.isnan(other.ends[0]))
            self._add_steps(np.array([other.ends[0] - self.ends[1]]))
        self.count += other.count
        self.missing += other.missing
        self.gaps += other.gaps
        self.low = min(self.low, other.low)
        self.high = max(self.high, other.high, key=lambda v: (v[0], -v[1]))
        self.steps.add(other.steps.high, other.steps.low)
        self.ends = other.ends if self.ends is None else (self.ends[0], other.ends[1])

    def state(self) -> dict[str, Any]:
        """Dict of plain values and arrays from which `restored` makes the same extremes."""
        return {
            "numbers": [self.count, self.missing, self.gaps],
            "low": list(self.low),
            "high": list(self.high),
            "steps": self.steps.state(),
            "ends": None if self.ends is None else list(self.ends),
        }

    @classmethod
    def restored(cls, state: dict[str, Any]) -> Extremes:
        """`Extremes` from the dict that `state()` returned, with copies of its arrays."""
        low, high, ends = (state[name] and tuple(state[name]) for name in ("low", "high", "ends"))
        count, missing, gaps = state["numbers"]
        return cls(count, missing, gaps, low, high, Sum(**state["steps"]), ends)


@dataclass(slots=True, eq=False)
class StreamSegment:
    """Samples `start` … `stop` − 1 of a stream: level, curve and extremes of each column, and level of each covariate."""

    start: int
    stop: int
    levels: list[Level]
    curves: list[Accumulator]
    extremes: list[Extremes]

    @classmethod
    def empty(
        cls,
        start: int,
        columns: int,
        covariates: int,
        rate: float,
        units: tuple[str, ...],
        threads: int = 1,
        taus_per_octave: int = TAUS_PER_OCTAVE,
    ) -> StreamSegment:
        """`StreamSegment` without samples that begins at index `start`, for this number of columns and covariates."""
        return cls(
            start,
            start,
            [
                Level(0, start, start, i < columns, threads=threads)
                for i in range(columns + covariates)
            ],
            [Accumulator(rate, taus_per_octave, unit=unit, start=start) for unit in units],
            [Extremes() for _ in range(columns)],
        )

    def update(self, columns: list[NDArray[Any]]) -> None:
        """Append the next samples in place: arrays of equal length, one for each column and then one for each covariate."""
        for task in self.tasks(columns):
            task()

    def tasks(self, columns: list[NDArray[Any]]) -> list[Callable[[], None]]:
        """List of functions that together append `columns`, as `update` does; they may run in parallel.

        The caller must run all of them before the next call: `stop` increases at once.
        """
        values = [np.require(x, np.float64, ["C", "A"]) for x in columns]
        at = self.stop
        self.stop += columns[0].size
        levels = zip(self.levels, values, strict=True)
        looks = zip(self.curves, self.extremes, columns, values, strict=False)
        return [
            *(partial(level.extend, x) for level, x in levels),
            *(
                partial(_update_column, curve, extremes, at, given, x)
                for curve, extremes, given, x in looks
            ),
        ]

    def merge(self, other: StreamSegment) -> None:
        """Append `other`, the segment that begins where this one ends, in place; do not use `other` afterwards."""
        self.levels = [join_levels(a, b) for a, b in zip(self.levels, other.levels, strict=True)]
        for curve, theirs in zip(self.curves, other.curves, strict=True):
            curve.merge(theirs)
        for mine, others in zip(self.extremes, other.extremes, strict=True):
            mine.merge(others)
        self.stop = other.stop

    def one_column(self, place: int, covariates: slice) -> StreamSegment:
        """`StreamSegment` of the column with index `place` and the levels `covariates`, which shares its arrays."""
        return StreamSegment(
            self.start,
            self.stop,
            [self.levels[place], *self.levels[covariates]],
            [self.curves[place]],
            [self.extremes[place]],
        )

    def state(self) -> dict[str, Any]:
        """Dict of plain values and arrays from which `restored` makes the same segment."""
        return {
            "start": self.start,
            "stop": self.stop,
            "levels": [level.state() for level in self.levels],
            "curves": [curve.state() for curve in self.curves],
            "extremes": [one.state() for one in self.extremes],
        }

    @classmethod
    def restored(cls, state: dict[str, Any]) -> StreamSegment:
        """`StreamSegment` from the dict that `state()` returned."""
        return cls(
            state["start"],
            state["stop"],
            [Level.restored(one) for one in state["levels"]],
            [Accumulator.restored(one) for one in state["curves"]],
            [Extremes.restored(one) for one in state["extremes"]],
        )


def _update_column(
    curve: Accumulator, extremes: Extremes, at: int, given: NDArray[Any], x: Array
) -> None:
    """Add the samples from index `at` on to Allan curve and extremes of a column; `x` is `given` as float64."""
    # The curve of integers is exact, so that they are not converted.
    whole = given if given.dtype.kind in "iu" else x
    for first in range(0, x.size, SAMPLES_AT_ONCE):
        curve.update(whole[first : first + SAMPLES_AT_ONCE])
        extremes.update(x[first : first + SAMPLES_AT_ONCE], at + first)

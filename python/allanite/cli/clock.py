"""The time column of a log that is not kept: where samples are missing, and what all its stamps say."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.recording.stamp_units import TIME_UNITS, numbers_of, unit_of_stamps
from allanite.recording.steps import WINDOW, Steps
from allanite.recording.timebase import FILL, Stamps

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

__all__ = ["Clock"]

#: Rows kept back until those behind them are there: a late stamp before an early one is no gap, and
#: stamps that run off may come back.
BEHIND = WINDOW + 1
#: Rows already given by which those at the border of two chunks are judged.
BEFORE = 1024
#: Missing rows that are made at a time.
ROWS = 1 << 16
#: Missing rows of one gap that are made whatever the log's length.
FEW = 1 << 24


class Clock:
    """Stamps in column `at` of a log's chunks."""

    def __init__(self, at: int, unit: str | None, rate: float | None = None) -> None:
        self.at, self.unit, self.rate = at, unit, rate
        self.why = "given"
        self.rows = self.duplicates = self.backwards = 0
        self.first_duplicate = self.first_backwards = -1
        self.counts = self.times = self.squares = self.wrap = 0.0
        self.resolution = math.inf
        self.gaps: list[tuple[int, int]] = []
        self.seams: list[tuple[int, float]] = []
        self.wraps: list[int] = []
        self.coarse = self.lost = False

    def fill(self, chunks: Iterable[NDArray[Any]]) -> Iterator[NDArray[Any]]:
        """Yield the rows of the chunks, rows of NaN where the stamps show missing samples.

        Raises
        ------
        InputError
            A stamp that is not finite, or stamps that do not advance.
        """
        held: NDArray[Any] | None = None
        given = 0
        for chunk in chunks:
            rows = chunk if held is None else np.concatenate((held, chunk))
            end = max(len(rows) - BEHIND, given)
            if end > given:
                yield from self._pieces(rows, given, end)
            first = max(end - BEFORE, 0)
            held, given = rows[first:], end - first
        if held is not None and len(held) > given:
            yield from self._pieces(held, given, len(held))

    def _pieces(self, rows: NDArray[Any], begun: int, end: int) -> Iterator[NDArray[Any]]:
        """Rows from `begun` to `end`, with what is missing before each."""
        before = self.rows - begun
        time = rows[:, self.at]
        bad = np.flatnonzero(~np.isfinite(time))
        if bad.size:
            raise InputError(
                f"the time column holds {time[bad[0]]} at row {before + int(bad[0])}; give --rate"
                " and leave the column out (--time-column none)"
            )
        if time.size < 2:
            yield rows[begun:end]
            self.rows += end - begun
            return
        stamps, _ = numbers_of(time, self.unit)
        steps = Steps(np.diff(stamps).astype(np.float64), stamps)
        if self.unit is None:
            self.unit, self.why = unit_of_stamps(stamps, 1.0 / steps.rate, self.rate)
        self.coarse |= steps.coarse
        self.lost |= steps.lost
        at = begun
        for row, missing in steps.gaps:
            if not begun - 1 <= row < end - 1:
                continue
            if missing > max(FEW, FILL * self.rows):
                raise InputError(
                    f"the time column jumps by {missing / steps.rate:.4g} (of its unit) after row"
                    f" {before + row}: give the log as a file, or --rate with --time-column none"
                )
            yield rows[at : row + 1]
            at = row + 1
            self.gaps.append((before + row, missing))
            for part in range(0, missing, ROWS):
                yield np.full((min(ROWS, missing - part), rows.shape[1]), np.nan)
        yield rows[at:end]
        self._count(steps, max(begun - 1, 0), end - 1, before)
        self.rows += end - begun

    def _count(self, steps: Steps, first: int, end: int, before: int) -> None:
        """Add the steps from `first` to `end`."""
        raw = steps.raw[first:end]
        if raw.size == 0:
            return
        second = TIME_UNITS[self.unit or "s"]
        self.counts += float(steps.counts[first:end].sum())
        self.times += float(steps.times[first:end].sum())
        forward = raw[raw > 0]
        if forward.size:
            self.resolution = min(self.resolution, float(forward.min()))
        here = [row for row in steps.wraps if first <= row < end]
        self.wraps += [before + row for row in here]
        self.wrap = max(self.wrap, steps.wrap * second * bool(here))
        seams = [row for row in steps.seams if first <= row < end]
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
        clean = steps.clean[first:end][regular[first:end]]
        self.squares += float(np.var(clean)) * raw.size if clean.size else 0.0

    def stamps(self) -> Stamps:
        """Return what the stamps say, as of a column that is kept; the jitter is that about each chunk's mean.

        A drift of the interval is not looked for.
        """
        second = TIME_UNITS[self.unit or "s"]
        if self.times <= 0.0:
            raise InputError("the time column does not advance; give --rate")
        return Stamps(
            rate=self.counts / (self.times * second),
            unit=self.unit or "s",
            why=self.why,
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
        )

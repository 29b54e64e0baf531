"""Time stamps of a log that is read in chunks: fills gaps with NaN rows, and sums up all stamps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.recording.stamp_units import TIME_UNITS, stamp_numbers, unit_of_stamps
from allanite.recording.steps import MAX_DISORDER_ROWS, Steps
from allanite.recording.timebase import MAX_MISSING_RATIO, Stamps

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

#: Rows at the end of a chunk that wait for the next chunk. Later stamps may show that a late stamp is no gap, or that
#: diverging stamps return (`allanite.recording.steps.MAX_DISORDER_ROWS`).
HELD_BACK_ROWS = MAX_DISORDER_ROWS + 1
#: Rows of the last chunk that are repeated, so that stamps at the border have neighbors. Chosen by judgment; not measured.
REPEATED_ROWS = 1024
#: Maximum number of NaN rows per yielded chunk.
FILL_ROWS = 1 << 16
#: A gap of up to this many missing rows is filled, however short the log is. Chosen by judgment; not measured.
MAX_GAP_ROWS = 1 << 24


class Clock:
    """Time stamps in column `at` of a log that is read chunk by chunk: fills gaps, and sums up the intervals.

    `unit` is the unit of the stamps, or None if the numbers show it. `rate` is the given sampling rate in Hz, or None.
    """

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
        """Yield arrays with the rows of the chunks, and with rows of NaN in place of missing samples.

        Raises
        ------
        InputError
            A stamp that is not finite, or stamps that do not advance.
        """
        held: NDArray[Any] | None = None
        given = 0
        for chunk in chunks:
            rows = chunk if held is None else np.concatenate((held, chunk))
            end = max(len(rows) - HELD_BACK_ROWS, given)
            if end > given:
                yield from self._filled(rows, given, end)
            first = max(end - REPEATED_ROWS, 0)
            held, given = rows[first:], end - first
        if held is not None and len(held) > given:
            yield from self._filled(held, given, len(held))

    def _filled(self, rows: NDArray[Any], begun: int, end: int) -> Iterator[NDArray[Any]]:
        """Yield arrays with the rows from `begun` to `end`, and rows of NaN in each gap of the time stamps.

        `rows` also holds rows before and after, as neighbors of the stamps at the borders. Updates the sums of the
        clock. Raises `InputError` for a stamp that is not finite, or for a jump that is too long to fill.
        """
        before = self.rows - begun
        time = rows[:, self.at]
        bad = np.flatnonzero(~np.isfinite(time))
        if bad.size:
            raise InputError(
                f"the time column holds {time[bad[0]]} at row {before + int(bad[0])}: ignore the column with"
                " --time-column none and --rate HZ"
            )
        if time.size < 2:
            yield rows[begun:end]
            self.rows += end - begun
            return
        stamps, _ = stamp_numbers(time, self.unit)
        steps = Steps(np.diff(stamps).astype(np.float64), stamps)
        if self.unit is None:
            self.unit, self.why = unit_of_stamps(stamps, 1.0 / steps.rate, self.rate)
        self.coarse |= steps.coarse
        self.lost |= steps.lost
        at = begun
        for row, missing in steps.gaps:
            if not begun - 1 <= row < end - 1:
                continue
            if missing > max(MAX_GAP_ROWS, MAX_MISSING_RATIO * self.rows):
                raise InputError(
                    f"the time column jumps by {missing / steps.rate:.4g} (in its own unit) after row"
                    f" {before + row}: give the log as a file, or ignore the column with --time-column none and"
                    " --rate HZ"
                )
            yield rows[at : row + 1]
            at = row + 1
            self.gaps.append((before + row, missing))
            for part in range(0, missing, FILL_ROWS):
                yield np.full((min(FILL_ROWS, missing - part), rows.shape[1]), np.nan)
        yield rows[at:end]
        self._add_intervals(steps, max(begun - 1, 0), end - 1, before)
        self.rows += end - begun

    def _add_intervals(self, steps: Steps, first: int, end: int, before: int) -> None:
        """Add the intervals between stamps from `first` to `end` to the sums, with their repeats, seams and wraps.

        `before` is the number of rows before the first row of `steps`.
        """
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
        """`Stamps` of all rows read so far: rate, gaps, jitter and resolution, as `read_stamps` returns them.

        The jitter is relative to the mean interval of each chunk. A drift of the interval is not computed. Raises
        `InputError` if the stamps do not advance.
        """
        second = TIME_UNITS[self.unit or "s"]
        if self.times <= 0.0:
            raise InputError(
                "the time column does not advance: ignore it with --time-column none and --rate HZ"
            )
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

"""The time column of a log that is not kept: where samples are missing, and what all its stamps say."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.recording.timebase import TIME_UNITS, Stamps, read_stamps

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

__all__ = ["Clock"]

#: Rows kept back until those behind them are there: a late stamp before an early one is no gap.
BEHIND = 2
#: Rows already given by which those at the border of two chunks are judged.
BEFORE = 1024
#: Missing rows that are made at a time.
ROWS = 1 << 16


class Clock:
    """Stamps in column `at` of a log's chunks."""

    def __init__(self, at: int, unit: str | None, log: str) -> None:
        self.at, self.unit, self.log = at, unit, log
        self.guessed = unit is None
        self.rows = self.duplicates = self.backwards = 0
        self.first_backwards = -1
        self.span = self.squares = 0.0
        self.resolution = math.inf
        self.gaps: list[tuple[int, int]] = []
        self.coarse = False

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
                f"{self.log}: the time column holds {time[bad[0]]} at row {before + int(bad[0])}; give --rate"
                " and leave the column out"
            )
        stamps = read_stamps(time, self.unit)
        self.unit = stamps.unit
        self.coarse |= stamps.coarse
        late = {} if self.coarse else dict(stamps.gaps)
        at = begun
        for row, missing in stamps.gaps:
            if self.coarse or not begun - 1 <= row < end - 1:
                continue
            yield rows[at : row + 1]
            at = row + 1
            self.gaps.append((before + row, missing))
            for part in range(0, missing, ROWS):
                yield np.full((min(ROWS, missing - part), rows.shape[1]), np.nan)
        yield rows[at:end]
        self._count(
            time[max(begun - 1, 0) : end].astype(np.float64), late, max(begun - 1, 0), before
        )
        self.rows += end - begun

    def _count(
        self, time: NDArray[np.float64], late: dict[int, int], offset: int, before: int
    ) -> None:
        steps = np.diff(time)
        if steps.size == 0:
            return
        self.span += float(steps.sum())
        forward = steps[steps > 0]
        if forward.size:
            self.resolution = min(self.resolution, float(forward.min()))
        self.duplicates += int(np.count_nonzero(steps == 0))
        back = np.flatnonzero(steps < 0)
        if back.size and not self.backwards:
            self.first_backwards = before + offset + int(back[0]) + 1
        self.backwards += int(back.size)
        regular = np.ones(steps.size, dtype=bool)
        regular[[row - offset for row in late if 0 <= row - offset < steps.size]] = False
        self.squares += float(np.var(steps[regular])) * steps.size if regular.any() else 0.0

    def stamps(self) -> Stamps:
        """Return what the stamps say, as of a column that is kept; the jitter is that about each chunk's mean."""
        second = TIME_UNITS[self.unit or "s"]
        steps = max(self.rows - 1, 1)
        missing = sum(count for _, count in self.gaps)
        if self.span <= 0.0:
            raise InputError(f"{self.log}: the time column does not advance; give --rate")
        return Stamps(
            rate=(steps + missing) / (self.span * second),
            unit=self.unit or "s",
            guessed=self.guessed,
            n=self.rows,
            jitter=math.sqrt(self.squares / steps) * second,
            resolution=self.resolution * second,
            duplicates=self.duplicates,
            backwards=self.backwards,
            first_backwards=self.first_backwards,
            gaps=tuple(self.gaps),
            coarse=self.coarse,
        )

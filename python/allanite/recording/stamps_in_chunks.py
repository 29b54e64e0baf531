"""Time stamps that are read in chunks, in constant memory, and gaps of a record that is read in chunks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.recording.stamp_units import stamp_numbers, unusable_stamps
from allanite.recording.steps import MAX_DISORDER_ROWS
from allanite.recording.timebase import Stamps, StampSums

#: Rows at the end of a chunk that wait for the next chunk. Later stamps may show that a late stamp is no gap, or that
#: diverging stamps return (`allanite.recording.steps.MAX_DISORDER_ROWS`).
HELD_BACK_ROWS = MAX_DISORDER_ROWS + 1
#: Rows of the last chunk that are repeated, so that stamps at the border have neighbors. Chosen by judgment; not measured.
REPEATED_ROWS = 1024
#: Maximum number of NaN rows per yielded chunk.
FILL_ROWS = 1 << 16


def read_stamps_in_chunks(
    chunks: Iterable[NDArray[Any]], unit: str | None, rate: float | None, piece: int | None
) -> Stamps:
    """`Stamps` of a time column whose chunks, shape (rows,), follow each other; as `read_stamps` returns them.

    The jitter is relative to the mean interval of each chunk. A drift of the interval is not computed. `unit`, `rate`
    and `piece` are those of `read_stamps`.

    Raises
    ------
    InputError
        A stamp that is not finite, stamps that do not advance, or an unknown segment.
    """
    sums = StampSums(unit, rate)
    held: NDArray[Any] = np.empty(0)
    given = 0

    def add(rows: NDArray[Any], end: int) -> None:
        """Add the stamps ``rows[given:end]`` to the sums, in place; returns None.

        The `rows` before and after them are only neighbors. Raises `InputError` if any of the `rows` is not finite.
        """
        bad = np.flatnonzero(~np.isfinite(rows))
        if bad.size:
            row = sums.rows - given + int(bad[0])
            raise unusable_stamps(
                f"the time column holds {rows[bad[0]]} at row {row}: remove such rows", ", or "
            )
        sums.add(stamp_numbers(rows, unit)[0], given, end)

    for chunk in chunks:
        rows = np.concatenate((held, chunk)) if held.size else chunk
        end = max(len(rows) - HELD_BACK_ROWS, given)
        if end > given:
            add(rows, end)
        first = max(end - REPEATED_ROWS, 0)
        held, given = rows[first:], end - first
    if len(held) > given:
        add(held, len(held))
    return sums.stamps(piece)


def fill_gaps_in_chunks(chunks: Iterable[NDArray[Any]], stamps: Stamps) -> Iterator[NDArray[Any]]:
    """Yield arrays of shape (rows, columns) with the rows of the segment used, and rows of NaN for missing samples.

    Some of the arrays may be empty.
    """
    first, end = stamps.rows
    gaps, row = list(stamps.gaps_in_segment), 0
    for chunk in chunks:
        at, stop = max(first - row, 0), min(len(chunk), end - row)
        while gaps and gaps[0][0] < row + stop:
            after, missing = gaps.pop(0)
            yield chunk[at : after + 1 - row]
            at = after + 1 - row
            for part in range(0, missing, FILL_ROWS):
                yield np.full((min(FILL_ROWS, missing - part), chunk.shape[1]), np.nan)
        yield chunk[at : max(stop, at)]
        row += len(chunk)

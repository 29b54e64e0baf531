"""Logs larger than the memory: text and NPY files are read in chunks, and summarized."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError, about
from allanite.common.memory import budget
from allanite.common.plain import plain
from allanite.common.threads import processors
from allanite.common.units import rate_unit
from allanite.common.validation import positive_rate
from allanite.readers import findings_of_layout, refuse_contradicting_rate
from allanite.readers._lines import head_of
from allanite.readers._table import Table
from allanite.readers.arrays import npy
from allanite.readers.columns import Layout, layout_of
from allanite.readers.text import (
    core_errors_with_remedy,
    day_comes_first,
    exchange_day_and_month,
    first_rows_of,
    has_slashed_dates,
    with_day_first,
)
from allanite.recording.findings import stamp_findings
from allanite.recording.samples import factors_to, require_finite
from allanite.recording.stamp_units import stamp_numbers, unusable_stamps
from allanite.recording.steps import MAX_DISORDER_ROWS
from allanite.recording.timebase import Stamps, StampSums
from allanite.summary.making import summary_of_chunks

if TYPE_CHECKING:
    from allanite.common.read_options import ReadOptions
    from allanite.readers.time_parts import TimeParts
    from allanite.summary import Summary

    _Rows = Callable[[Sequence[int]], Iterator[NDArray[Any]]]

#: First bytes of an NPY file.
NPY = b"\x93NUMPY"
#: Number of rows per chunk.
CHUNK_ROWS = 1 << 16
#: Rows at the end of a chunk that wait for the next chunk. Later stamps may show that a late stamp is no gap, or that
#: diverging stamps return (`MAX_DISORDER_ROWS`).
HELD_BACK_ROWS = MAX_DISORDER_ROWS + 1
#: Rows of the last chunk that are repeated, so that stamps at the border have neighbors. Chosen by judgment; not measured.
REPEATED_ROWS = 1024
#: Maximum number of NaN rows per yielded chunk.
FILL_ROWS = 1 << 16


def is_too_large(path: Path) -> bool:
    """True if a text log (no null byte in its first 8192 bytes) or NPY file is larger than the memory budget."""
    if not path.is_file() or path.stat().st_size <= budget():
        return False
    head = head_of(path)
    return head.startswith(NPY) or b"\0" not in head


def summary_of_log(
    path: Path, options: ReadOptions, unit: str | None, taus_per_octave: int
) -> Summary:
    """`Summary` of the sensor columns of a text log or NPY file of any size, read in chunks.

    Covariates are not read. `unit` is that of the samples, as in `Recording.to`; None converts none. Raises `InputError`
    without a rate, for a rate that contradicts the log, an invalid cell or an unknown column, and `TooShortError` for too
    few rows.
    """
    with about(path), core_errors_with_remedy(str(path)):
        first, rows = (_open_npy if head_of(path).startswith(NPY) else _open_text)(path)
        if first.n < 3:
            raise TooShortError("fewer than 3 rows of numbers")
        layout = layout_of(first, options)
        refuse_contradicting_rate(options, first.rate, None)
        stamps = _stamps_of(rows, layout, options)
        rate = options.rate_hz if options.rate_hz is not None else first.rate
        rate = stamps.rate if rate is None and stamps is not None else rate
        if rate is None:
            raise InputError(
                "no sampling rate", missing="rate", remedy=": give {rate} or a time column"
            )
        rate = positive_rate(rate)
        refuse_contradicting_rate(options, None, stamps)
        units = tuple(rate_unit(one, layout.quantity).name for one in layout.units)
        factors = np.array([layout.columns[i].scale for i in layout.samples])
        factors *= 1.0 if layout.quantity == "rate" else rate
        if unit is not None:
            conversions, units = factors_to(unit, units)
            factors *= conversions
        names = [first.names[i] for i in layout.samples]
        chunks = rows(layout.samples)
        if stamps is not None:
            chunks = _with_filled_gaps(chunks, stamps)
        if layout.quantity == "angle":
            chunks = _differences_of_chunks(chunks)
        if (factors != 1.0).any():
            chunks = (chunk * factors for chunk in chunks)
        summary = summary_of_chunks(
            chunks, rate, units, 0, names, plain(path), processors(), taus_per_octave
        )
        findings = findings_of_layout(options, first, layout)
        of_stamps = stamp_findings(stamps, rate) if stamps else ()
        return replace(summary, added_findings=(*findings, *of_stamps))


def _stamps_of(rows: _Rows, layout: Layout, options: ReadOptions) -> Stamps | None:
    """`Stamps` of the time columns of a log, or None without a time column."""
    roles, unit = layout.roles, layout.time_unit
    if roles.time is None:
        return None
    chunks = rows(roles.time_columns)
    if roles.parts is None:
        times: Iterable[NDArray[Any]] = (chunk[:, 0] for chunk in chunks)
    else:
        times, unit = _times_of_chunks(chunks, roles.parts), "s"
    return _read_stamps(times, unit, options.rate_hz, options.piece)


def _read_stamps(
    chunks: Iterable[NDArray[Any]], unit: str | None, rate: float | None, piece: int | None
) -> Stamps:
    """`Stamps` of a time column given in chunks of shape (rows,), as `read_stamps` returns them, but without a drift.

    The jitter is relative to the mean interval of each chunk. Raises `InputError` for stamps that are not finite or do
    not advance, and for an unknown segment.
    """
    sums = StampSums(unit, rate)
    held: NDArray[Any] = np.empty(0)
    given = 0

    def add(rows: NDArray[Any], end: int) -> None:
        """Add the stamps ``rows[given:end]`` to the sums; the others are only neighbors.

        Raises `InputError` if any of the `rows` is not finite.
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


def _with_filled_gaps(chunks: Iterable[NDArray[Any]], stamps: Stamps) -> Iterator[NDArray[Any]]:
    """Yield arrays (rows, columns), maybe empty, with the rows of the segment used, and NaN for missing samples."""
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


def _times_of_chunks(chunks: Iterable[NDArray[Any]], parts: TimeParts) -> Iterator[Array]:
    """Yield the time of each row of a chunk in s from the columns of the chunk; see `TimeParts.joined` for its zero."""
    origin: list[float] | None = None
    for chunk in chunks:
        arrays = list(chunk.T)
        origin = [float(x[0]) for x in arrays] if origin is None else origin
        yield parts.joined(arrays, origin)


def _differences_of_chunks(chunks: Iterable[NDArray[Any]]) -> Iterator[NDArray[Any]]:
    """Yield the differences of consecutive rows, as if the chunks were one array."""
    last: NDArray[Any] | None = None
    for chunk in chunks:
        # Differences of narrow or unsigned integers would wrap. Those of 64-bit integers are exact modulo 2^64.
        x = chunk.astype(np.int64) if chunk.dtype.kind in "iu" else chunk
        x = x if last is None else np.concatenate((last, x))
        last = x[-1:]
        yield np.diff(x, axis=0)


def _open_text(path: Path) -> tuple[Table, _Rows]:
    """Tuple (table of the first rows, function that yields the given columns in chunks) of a text log.

    Slashed dates, such as 05/03/2026, are read once in advance, to find out whether the day comes first.
    """
    first, cells, delimiter = first_rows_of(path)

    def rows_as_written(wanted: Sequence[int]) -> Iterator[NDArray[Any]]:
        """Yield the given columns of all rows in chunks, shape (rows, columns); slashed dates have the month first."""
        reader = _kernels.TextReader(str(path), delimiter=delimiter, finite=True)
        reader.select(wanted)
        while (chunk := reader.next(CHUNK_ROWS)) is not None:
            yield chunk

    slashed = [i for i in first.dates if has_slashed_dates(cells[i])]
    exchanged = {i for i in slashed if day_comes_first(c[:, 0] for c in rows_as_written([i]))}

    def rows(wanted: Sequence[int]) -> Iterator[NDArray[Any]]:
        """Yield the given columns of all rows in chunks, shape (rows, columns)."""
        for chunk in rows_as_written(wanted):
            for k, i in enumerate(wanted):
                if i in exchanged:
                    chunk[:, k] = exchange_day_and_month(chunk[:, k])
            yield chunk

    return with_day_first(first, cells, exchanged), rows


def _open_npy(path: Path) -> tuple[Table, _Rows]:
    """Tuple (table of the first rows, function that yields the given columns in chunks) of a memory-mapped NPY file.

    Raises `InputError` if a number is not finite, or if the file is no array of numbers.
    """
    array = npy.load(path, largest_read=0)
    if array.dtype.kind == "f":
        require_finite(array, None)

    def rows(wanted: Sequence[int]) -> Iterator[NDArray[Any]]:
        """Yield the given columns of all rows in chunks, shape (rows, columns)."""
        for at in range(0, len(array), CHUNK_ROWS):
            part = np.asarray(array[at : at + CHUNK_ROWS])
            # Integers keep their type, as doubles do not hold all 64-bit integers.
            yield (part if part.dtype.kind in "iu" else part.astype(np.float64))[:, wanted]

    return npy.table_of(array[:CHUNK_ROWS]), rows

"""Making of a summary in one pass through the samples of a record."""

from __future__ import annotations

import mmap
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.common.errors import InputError, TooShortError
from allanite.common.threads import Pool, processors
from allanite.common.validation import positive_rate
from allanite.recording import Recording
from allanite.recording.samples import column_names, unit_names
from allanite.summary.stream_segment import TAUS_PER_OCTAVE, StreamSegment
from allanite.summary.summary import Summary

#: Number of samples processed at a time, and minimum number of rows if there are several columns: enough tiles for several
#: threads, little memory.
SAMPLES_AT_ONCE, MIN_ROWS_AT_ONCE = 1 << 19, 1 << 18
#: Number of rows that are transposed at a time, so that they stay in the cache.
TRANSPOSED_ROWS = 1 << 13
#: The pages of a mapped file are released after this many bytes.
RELEASED_BYTES = 1 << 23


def summarize(
    chunks: Iterable[ArrayLike | Recording] | ArrayLike | Recording,
    rate: float | None = None,
    *,
    unit: str | Sequence[str] = "1",
    start: int = 0,
    columns: Sequence[str] | None = None,
    path: str | None = None,
) -> Summary:
    """`Summary` of a record, made in one pass over its chunks; it takes a few megabytes.

    Parameters
    ----------
    chunks : iterable of array_like or Recording, or one of these
        Consecutive samples, shape (n,) or (n, columns) each; NaN marks a missing sample. Recordings have their own rate,
        unit, names and covariates. A memory-mapped array is read in parts.
    rate : float, optional
        Sampling rate, Hz; by default that of recordings.
    unit : str or sequence of str
        Unit of the samples, or of each column.
    start : int
        Index of the first sample in its stream; `Summary.merge` orders segments by this index.
    columns : sequence of str, optional
        Names of the columns.
    path : str, optional
        Path of the source, for display.

    Returns
    -------
    Summary

    Raises
    ------
    InputError
        No rate, infinite samples, chunks with different columns, or angles (difference them first).
    TooShortError
        No samples.

    Examples
    --------
    >>> chunks = (np.full(1000, float(k)) for k in range(20))
    >>> al.summarize(chunks, rate=100.0, unit="deg/s").n
    20000
    """
    return summary_of_chunks(chunks, rate, unit, start, columns, path, processors())


def summary_of_chunks(
    chunks: Any,
    rate: float | None,
    unit: str | Sequence[str],
    start: int,
    columns: Sequence[str] | None,
    path: str | None,
    threads: int,
    taus_per_octave: int = TAUS_PER_OCTAVE,
) -> Summary:
    """`Summary` as `summarize` returns it, computed with `threads` threads, whose number does not change the result.

    Use one thread if other tasks occupy the processors. `taus_per_octave` is that of the Allan curve. Raises the errors of
    `summarize`, and `InputError` for a negative `start`.
    """
    if start < 0:
        raise InputError(f"start is {start}: the index of the first sample, from 0")
    segment: StreamSegment | None = None
    head: dict[str, Any] = {}
    with Pool(threads) if threads > 1 else nullcontext() as pool:
        for chunk in _chunks_of(chunks):
            taken, about = _tables_of(chunk, rate, unit, columns)
            if segment is None:
                head, width = about, sum(map(len, taken))
                segment = StreamSegment.empty(
                    start,
                    len(about["columns"]),
                    len(about["covariates_named"]),
                    about["rate"],
                    about["units"],
                    # The columns and their curves are computed side by side.
                    max(1, threads - 1 if width == 1 else threads // width),
                    taus_per_octave,
                )
            elif {**about, "path": None} != {**head, "path": None}:
                raise InputError(
                    f"a chunk with {', '.join(about['columns'])} at {about['rate']:g} Hz follows chunks with"
                    f" {', '.join(head['columns'])} at {head['rate']:g} Hz"
                )
            at_work: list[Future[None]] = []
            for rows in _batches_of_rows(taken, _memory_mapping(chunk)):
                if pool is None:
                    segment.update(rows)
                else:
                    # Rows are read while the rows before them are processed.
                    _wait_for_tasks(at_work)
                    at_work = [pool.submit(task) for task in segment.tasks(rows)]
            # The caller may reuse the memory of a chunk.
            _wait_for_tasks(at_work)
    if segment is None or segment.stop == segment.start:
        raise TooShortError("no samples")
    _kernels.trim()
    head["path"] = path if path is not None else head["path"]
    return Summary(**head, stretches=(segment,))


def _batches_of_rows(
    tables: list[NDArray[Any]], mapped: mmap.mmap | None
) -> Iterator[list[NDArray[Any]]]:
    """Iterator over lists of one array per column and covariate, each list with the next rows of the tables.

    The memory of the file mapping `mapped`, in which the tables lie, is released after use.
    """
    seen, count = 0, tables[0].shape[1]
    step = max(MIN_ROWS_AT_ONCE, SAMPLES_AT_ONCE // sum(map(len, tables)))
    for at in range(0, count, step):
        rows = [x for table in tables for x in _contiguous_rows(table[:, at : at + step])]
        yield rows
        seen += sum(x.nbytes for x in rows)
        if mapped is not None and (seen >= RELEASED_BYTES or at + step >= count):
            # The system keeps the pages in its cache, but they no longer count as memory of this process.
            mapped.madvise(mmap.MADV_DONTNEED)
            seen = 0


def _contiguous_rows(table: NDArray[Any]) -> NDArray[Any]:
    """Array with the shape and values of `table` in C order, a copy if needed; each row is one column of the record."""
    if table.shape[0] == 1 or table.flags.c_contiguous:
        return np.ascontiguousarray(table)
    out = np.empty(table.shape, table.dtype)
    for at in range(0, table.shape[1], TRANSPOSED_ROWS):
        out[:, at : at + TRANSPOSED_ROWS] = table[:, at : at + TRANSPOSED_ROWS]
    return out


def _wait_for_tasks(tasks: list[Future[None]]) -> None:
    """Wait until all tasks have ended. Raises the first exception of a task. Returns None."""
    for task in tasks:
        task.result()


def _memory_mapping(chunk: Any) -> mmap.mmap | None:
    """The `mmap` object behind a read-only `numpy.memmap`, else None; also None if the system cannot release its pages."""
    if not isinstance(chunk, np.memmap) or chunk.mode != "r" or not hasattr(mmap, "MADV_DONTNEED"):
        return None
    base: Any = chunk
    while isinstance(base, np.ndarray):
        base = base.base
    return base if isinstance(base, mmap.mmap) else None


def _chunks_of(chunks: Any) -> Iterable[Any]:
    """Iterable of chunks: `chunks` itself, or ``[chunks]`` if it is one recording, array, table or list of numbers.

    Raises `InputError` for an object that is not iterable.
    """
    if isinstance(chunks, (Recording, np.ndarray)) or hasattr(chunks, "__array__"):
        return [chunks]
    if isinstance(chunks, (list, tuple)) and chunks and np.isscalar(chunks[0]):
        return [chunks]
    if not isinstance(chunks, Iterable):
        raise InputError(f"cannot summarize {type(chunks).__name__}: chunks of samples are needed")
    return chunks


def _tables_of(
    chunk: Any, rate: float | None, unit: str | Sequence[str], columns: Sequence[str] | None
) -> tuple[list[NDArray[Any]], dict[str, Any]]:
    """Tuple (list of tables of a chunk, shape (columns, n) each; dict with its rate, units, names and path).

    The first table holds the columns; each covariate has a table of its own, shape (1, n). A recording overrides the
    arguments, and its increments become rates. Raises `InputError` for angles, for unusable arrays, and for an array
    without a rate.
    """
    if isinstance(chunk, Recording):
        if chunk.quantity == "angle":
            raise InputError("a summary is of rates: difference the angles first")
        per = 1.0 if chunk.quantity == "rate" else chunk.rate
        samples = chunk.samples if per == 1.0 else chunk.samples * per
        about = {
            "rate": chunk.rate,
            "units": chunk.units,
            "columns": chunk.columns,
            "covariates_named": tuple(chunk.covariates),
            "covariate_units": dict(chunk.covariate_units),
            "path": chunk.path,
        }
        table = samples if samples.ndim == 2 else samples[:, None]
        return [table.T, *(x[None] for x in chunk.covariates.values())], about
    array = chunk if isinstance(chunk, np.ndarray) else np.asarray(chunk)
    if array.dtype.kind not in "iuf" or array.ndim not in (1, 2) or 0 in array.shape[1:]:
        raise InputError(
            f"a chunk must hold real numbers of shape (n,) or (n, columns), found {array.dtype} of shape {array.shape}"
        )
    if rate is None:
        raise InputError("no sampling rate", missing="rate", remedy=": give {rate}")
    names = column_names(columns, array)
    about = {
        "rate": positive_rate(rate),
        "units": unit_names(unit, "rate", len(names)),
        "columns": names,
        "covariates_named": (),
        "covariate_units": {},
        "path": None,
    }
    return [(array if array.ndim == 2 else array[:, None]).T], about

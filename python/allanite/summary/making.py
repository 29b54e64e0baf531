"""The one pass over a record."""

from __future__ import annotations

import mmap
from collections.abc import Iterable
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError, TooShortError
from allanite.common.threads import Pool, processors
from allanite.common.units import rate_unit
from allanite.common.validation import positive_rate
from allanite.recording import Recording
from allanite.recording.samples import column_names
from allanite.summary.stretch import Stretch
from allanite.summary.summary import Summary

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from concurrent.futures import Future

    from numpy.typing import ArrayLike, NDArray

__all__ = ["summarise", "taken_in"]

#: Samples taken at a time, and rows of many columns: tiles enough for several threads, and little memory.
SAMPLES, ROWS = 1 << 19, 1 << 18
#: Rows whose columns are put in order at a time: they stay in the cache.
BLOCK = 1 << 13
#: Bytes of a mapped file, about, after which they are let go.
SEEN = 1 << 23


def summarise(
    chunks: Iterable[ArrayLike | Recording] | ArrayLike | Recording,
    rate: float | None = None,
    *,
    unit: str | Sequence[str] = "1",
    start: int = 0,
    columns: Sequence[str] | None = None,
    path: str | None = None,
) -> Summary:
    """Take a record in one pass, a chunk at a time, and keep a few megabytes of it.

    Parameters
    ----------
    chunks : iterable of array_like or Recording, or one of these
        Consecutive samples, shape (n,) or (n, columns) each; NaN marks a missing one. Recordings bring rate, unit,
        names and covariates. A memory-mapped array is read as it is taken.
    rate : float, optional
        Hz; of recordings their own.
    unit : str or sequence of str
        Unit of the rate, or of each column.
    start : int
        Index of the first sample in its stream; `Summary.merge` orders pieces by it.
    columns : sequence of str, optional
        Names.
    path : str, optional
        Where the samples come from.

    Returns
    -------
    Summary

    Raises
    ------
    InputError
        No rate, infinite samples, chunks of different columns, angles (difference them first).
    TooShortError
        No sample at all.

    Examples
    --------
    >>> chunks = (np.full(1000, float(k)) for k in range(20))
    >>> al.summarise(chunks, rate=100.0, unit="deg/s").n
    20000
    """
    return taken_in(chunks, rate, unit, start, columns, path, processors())


def taken_in(
    chunks: Any,
    rate: float | None,
    unit: str | Sequence[str],
    start: int,
    columns: Sequence[str] | None,
    path: str | None,
    threads: int,
) -> Summary:
    """`summarise` by so many threads, which do not change a bit of it: where others are at work beside it, by one."""
    if start < 0:
        raise InputError(f"start is {start}: the index of the first sample, from 0")
    with Pool(threads) if threads > 1 else nullcontext() as pool:
        return _taken_in(chunks, (rate, unit, columns), start, path, threads, pool)


def _taken_in(
    chunks: Any,
    asked: tuple[float | None, str | Sequence[str], Sequence[str] | None],
    start: int,
    path: str | None,
    threads: int,
    pool: Pool | None,
) -> Summary:
    stretch: Stretch | None = None
    head: dict[str, Any] = {}
    for chunk in _pieces(chunks):
        taken, about = _taken(chunk, *asked)
        if stretch is None:
            head, width = about, sum(map(len, taken))
            stretch = Stretch.begun(
                start,
                len(about["columns"]),
                len(about["covariates_named"]),
                about["rate"],
                about["units"],
                # Columns and their curves are at work side by side.
                max(1, threads - 1 if width == 1 else threads // width),
            )
        elif {**about, "path": None} != {**head, "path": None}:
            raise InputError(
                f"a chunk with {', '.join(about['columns'])} at {about['rate']:g} Hz follows chunks with"
                f" {', '.join(head['columns'])} at {head['rate']:g} Hz"
            )
        at_work: list[Future[None]] = []
        for rows in _rows(taken, _mapped(chunk)):
            if pool is None:
                stretch.update(rows)
            else:
                # Rows are read while those before them are taken in.
                _ended(at_work)
                at_work = [pool.submit(task) for task in stretch.tasks(rows)]
        # The caller may use the memory of a chunk again.
        _ended(at_work)
    if stretch is None or stretch.stop == stretch.start:
        raise TooShortError("no samples")
    _kernels.trim()
    head["path"] = path if path is not None else head["path"]
    return Summary(**head, stretches=(stretch,))


def _rows(tables: list[NDArray[Any]], mapped: mmap.mmap | None) -> Iterator[list[NDArray[Any]]]:
    """The samples of every column, so many at a time."""
    seen, count = 0, tables[0].shape[1]
    step = max(ROWS, SAMPLES // sum(map(len, tables)))
    for at in range(0, count, step):
        rows = [x for table in tables for x in _in_order(table[:, at : at + step])]
        yield rows
        seen += sum(x.nbytes for x in rows)
        if mapped is not None and (seen >= SEEN or at + step >= count):
            # Pages that were read stay with the system, but do not count as memory of this process.
            mapped.madvise(mmap.MADV_DONTNEED)
            seen = 0


def _in_order(table: NDArray[Any]) -> NDArray[Any]:
    """A row a column, each in one piece; a few samples of all at a time, for a column is read with its neighbours."""
    if table.shape[0] == 1 or table.flags.c_contiguous:
        return np.ascontiguousarray(table)
    out = np.empty(table.shape, table.dtype)
    for at in range(0, table.shape[1], BLOCK):
        out[:, at : at + BLOCK] = table[:, at : at + BLOCK]
    return out


def _ended(tasks: list[Future[None]]) -> None:
    for task in tasks:
        task.result()


def _mapped(chunk: Any) -> mmap.mmap | None:
    """The mapping of a file that is only read."""
    if not isinstance(chunk, np.memmap) or chunk.mode != "r" or not hasattr(mmap, "MADV_DONTNEED"):
        return None
    base: Any = chunk
    while isinstance(base, np.ndarray):
        base = base.base
    return base if isinstance(base, mmap.mmap) else None


def _pieces(chunks: Any) -> Iterable[Any]:
    """The chunks one after the other: an array, or a list of numbers, is one."""
    if isinstance(chunks, (Recording, np.ndarray)) or hasattr(chunks, "__array__"):
        return [chunks]
    if isinstance(chunks, (list, tuple)) and chunks and np.isscalar(chunks[0]):
        return [chunks]
    if not isinstance(chunks, Iterable):
        raise InputError(f"cannot summarise {type(chunks).__name__}: chunks of samples are needed")
    return chunks


def _taken(
    chunk: Any, rate: float | None, unit: str | Sequence[str], columns: Sequence[str] | None
) -> tuple[list[NDArray[Any]], dict[str, Any]]:
    """A chunk as tables of columns and of each covariate, a row a column, and what is known of them."""
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
    units = (unit,) * len(names) if isinstance(unit, str) else tuple(unit)
    if len(units) != len(names):
        raise InputError(f"{len(units)} units for {len(names)} columns")
    about = {
        "rate": positive_rate(rate),
        "units": tuple(rate_unit(text, "rate").name for text in units),
        "columns": names,
        "covariates_named": (),
        "covariate_units": {},
        "path": None,
    }
    return [(array if array.ndim == 2 else array[:, None]).T], about

"""Summaries by Dask: chunks become summaries, and a tree of merges one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.child_process import safe_path
from allanite.common.errors import AllaniteError, InputError
from allanite.common.plain import plain
from allanite.summary import Summary
from allanite.summary.making import summary_of_chunks

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Summaries", "summarise"]

#: Summaries merged at a time.
FAN = 8
#: Of the core in one task: the scheduler has as many tasks at work as there are processors.
THREADS = 1


@dataclass(frozen=True, slots=True, eq=False)
class Summaries:
    """Summaries of many logs, and the logs that could not be read.

    Attributes
    ----------
    summaries : dict of str to Summary
        By path.
    failed : dict of str to str
        What was wrong, by path.
    """

    summaries: dict[str, Summary]
    failed: dict[str, str]

    def __getitem__(self, path: str | Path) -> Summary:
        return self.summaries[str(path)]

    def __iter__(self) -> Iterator[Summary]:
        return iter(self.summaries.values())

    def __len__(self) -> int:
        return len(self.summaries)

    def __repr__(self) -> str:
        return f"Summaries({len(self.summaries)} logs, {len(self.failed)} failed)"


def summarise(
    source: Any,
    rate: float | None = None,
    *,
    unit: str | Sequence[str] | None = None,
    columns: Sequence[str] | None = None,
    client: Any = None,
) -> Any:
    """Summarise an array of Dask, or many logs, on whatever scheduler there is.

    The summaries of chunks are merged in a tree, which changes nothing: a chunk knows where it belongs, and sums do not
    depend on their order (`al.summarise`). A worker that dies is replaced, and what it had is computed again.

    Parameters
    ----------
    source : dask array, or sequence of paths
        Samples of one record, shape (n,) or (n, columns); or logs, each a record of its own.
    rate : float, optional
        Hz; of a log what it says itself.
    unit : str or sequence of str, optional
        Unit of the samples.
    columns : sequence of str, optional
        Names of the columns of an array; the columns of a log to be read.
    client : dask.distributed.Client, optional
        Where to compute; by default on Dask's present scheduler.

    Returns
    -------
    Summary, or Summaries of logs

    Raises
    ------
    InputError
        An array of unknown chunks or without a rate; nothing to read. A broken log is no error: it is among the failed.
    """
    from dask import delayed

    if hasattr(source, "to_delayed") and hasattr(source, "chunks"):
        return _computed([_tree(source, rate, unit or "1", columns)], client)[0]
    paths = [str(path) for path in ([source] if isinstance(source, (str, Path)) else source)]
    if not paths:
        raise InputError("no logs: give at least one")
    asked = delayed(_of_log, pure=False)
    found = _computed([asked(path, rate, unit, columns) for path in paths], client)
    good = {path: one for path, one in zip(paths, found, strict=True) if isinstance(one, Summary)}
    bad = {path: one for path, one in zip(paths, found, strict=True) if isinstance(one, str)}
    return Summaries(good, bad)


def _tree(array: Any, rate: float | None, unit: Any, columns: Sequence[str] | None) -> Any:
    from dask import delayed

    if array.ndim not in (1, 2):
        raise InputError(f"samples must have shape (n,) or (n, columns), found {array.shape}")
    if rate is None:
        raise InputError("no sampling rate", missing="rate", remedy=": give {rate}")
    if array.ndim == 2 and array.numblocks[1] > 1:
        array = array.rechunk({1: -1})
    sizes = [float(size) for size in array.chunks[0]]
    if any(np.isnan(sizes)):
        raise InputError("chunks of unknown size: call compute_chunk_sizes() first")
    starts = np.cumsum([0, *array.chunks[0]])
    level = [
        delayed(_of_block)(block, rate, unit, int(start), columns)
        for block, start in zip(array.to_delayed().ravel(), starts, strict=False)
    ]
    while len(level) > 1:
        level = [delayed(_merged)(level[at : at + FAN]) for at in range(0, len(level), FAN)]
    return level[0]


def _computed(tasks: list[Any], client: Any) -> list[Any]:
    """Results of tasks, each from the worker that has it: gathered in one task, they would all pass through one."""
    # A pool of processes starts in here, and so do workers that take the place of dead ones.
    with safe_path():
        if client is not None:
            return list(client.gather(client.compute(tasks)))
        from dask import compute

        return list(compute(*tasks))


def _of_block(
    block: NDArray[Any], rate: float, unit: Any, start: int, columns: Sequence[str] | None
) -> Summary:
    return summary_of_chunks(block, rate, unit, start, columns, None, THREADS)


def _merged(parts: list[Summary]) -> Summary:
    return parts[0].merge(*parts[1:])


def _of_log(path: str, rate: float | None, unit: Any, columns: Any) -> Summary | str:
    """The summary of a log, or what is wrong with it."""
    from allanite.readers import read

    try:
        return summary_of_chunks(
            read(path, rate, unit=unit, column=columns), None, "1", 0, None, None, THREADS
        )
    except AllaniteError as error:
        return plain(error, 300)

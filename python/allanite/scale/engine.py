"""Summaries with Dask: chunks become summaries, which are merged in a tree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from allanite.common.child_process import safe_path
from allanite.common.errors import AllaniteError, InputError
from allanite.common.plain import plain
from allanite.summary import Summary
from allanite.summary.making import summary_of_chunks

#: Number of summaries that one task merges.
MERGED_AT_ONCE = 8
#: Number of threads of one task; the scheduler runs as many tasks as there are processors.
TASK_THREADS = 1


@dataclass(frozen=True, slots=True, eq=False)
class Summaries:
    """Summary of each log by path, and in `failed` the reason of each log that could not be read."""

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


def summarize(
    source: Any,
    rate: float | None = None,
    *,
    unit: str | Sequence[str] | None = None,
    columns: Sequence[str] | None = None,
    client: Any = None,
) -> Any:
    """Summary of a Dask array, or summaries of many logs, computed on any Dask scheduler.

    The summaries of chunks are merged in a tree. The result does not depend on the tree, since each chunk knows its place
    and sums do not depend on their order (`al.summarize`). If a worker dies, its tasks are computed again.

    Parameters
    ----------
    source : dask array, or sequence of paths
        Samples of one record, shape (n,) or (n, columns); or paths of logs.
    rate : float, optional
        Sampling rate, Hz; by default that of a log.
    unit : str or sequence of str, optional
        Unit of the samples.
    columns : sequence of str, optional
        Names of the columns of an array; the columns of a log to be read.
    client : dask.distributed.Client, optional
        Client of the scheduler; by default Dask's present one.

    Returns
    -------
    Summary, or Summaries of logs

    Raises
    ------
    InputError
        An array of unknown chunks or without a rate, or no logs. A log that cannot be read is listed in `failed`.
    """
    from dask import delayed

    if hasattr(source, "to_delayed") and hasattr(source, "chunks"):
        return _computed_tasks([_summary_task(source, rate, unit or "1", columns)], client)[0]
    paths = [str(path) for path in ([source] if isinstance(source, (str, Path)) else source)]
    if not paths:
        raise InputError("no logs: give at least one")
    delayed_summary = delayed(_summary_of_log, pure=False)
    found = _computed_tasks([delayed_summary(path, rate, unit, columns) for path in paths], client)
    good = {path: one for path, one in zip(paths, found, strict=True) if isinstance(one, Summary)}
    bad = {path: one for path, one in zip(paths, found, strict=True) if isinstance(one, str)}
    return Summaries(good, bad)


def _summary_task(array: Any, rate: float | None, unit: Any, columns: Sequence[str] | None) -> Any:
    """Dask task whose result is the `Summary` of a whole array, merged from the summaries of its chunks.

    Raises `InputError` for a wrong shape, without a rate, and for chunks of unknown size.
    """
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
        delayed(summary_of_chunks)(block, rate, unit, int(start), columns, None, TASK_THREADS)
        for block, start in zip(array.to_delayed().ravel(), starts, strict=False)
    ]
    while len(level) > 1:
        level = [
            delayed(Summary.merge)(*level[at : at + MERGED_AT_ONCE])
            for at in range(0, len(level), MERGED_AT_ONCE)
        ]
    return level[0]


def _computed_tasks(tasks: list[Any], client: Any) -> list[Any]:
    """List of the results of Dask tasks, in their order; without a client, Dask's default scheduler computes them."""
    # Worker processes, and replacements of dead ones, start in this block.
    with safe_path():
        if client is not None:
            # Summaries that pass through the scheduler take three times the processor time of this process. Dask asks the
            # scheduler for those of a worker that does not answer.
            direct = client.direct_to_workers is not False
            return list(client.gather(client.compute(tasks), direct=direct))
        from dask import compute

        return list(compute(*tasks))


def _summary_of_log(path: str, rate: float | None, unit: Any, columns: Any) -> Summary | str:
    """`Summary` of a log, or a text (at most 300 characters) with the reason why the log cannot be read."""
    from allanite.readers import read

    try:
        return summary_of_chunks(
            read(path, rate, unit=unit, column=columns), None, "1", 0, None, None, TASK_THREADS
        )
    except AllaniteError as error:
        return plain(error, 300)

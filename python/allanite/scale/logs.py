"""Every log of a fleet, every axis: one row of numbers each, and a journal that outlives the process."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from time import perf_counter
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from allanite.common.errors import AllaniteError, InputError
from allanite.common.files import check_target, whole_file
from allanite.common.parameters import Estimate
from allanite.common.plain import plain
from allanite.common.threads import processors

if TYPE_CHECKING:
    from allanite.study import Study

__all__ = ["JOURNAL", "logs_of", "rows_of", "run_fleet", "write_table"]

#: What a journal's name ends with; it stands beside the table.
JOURNAL = ".journal"
#: Single tests that a ladder makes for each effect that it adds, at least: what its p-value is multiplied by. It tries all
#: kinds, again on each rung; the search for one kind alone may be worth less.
TRIALS = 1000.0
#: Logs at work at a time, for each worker: the rest wait on the disk.
AHEAD = 2


def logs_of(source: str | Path | Sequence[str | Path]) -> list[Path]:
    """Logs of a folder, a pattern, a list in a text file, or a sequence, in the order of their names; or the one log.

    Raises
    ------
    InputError
        There are none.
    """
    if isinstance(source, (str, Path)):
        path = Path(source)
        if path.is_dir():
            found = [p for p in path.rglob("*") if p.is_file() and not p.name.startswith(".")]
        elif any(sign in str(source) for sign in "*?["):
            anchor = Path(path.anchor or ".")
            found = [p for p in anchor.glob(str(path.relative_to(path.anchor))) if p.is_file()]
        elif path.is_file():
            found = _listed(path) or [path]
        else:
            raise InputError(f"{source}: no such folder, pattern or list")
    else:
        found = [Path(p) for p in source]
    if not found:
        raise InputError(f"{source}: no log in it")
    return sorted(found)


def _listed(path: Path) -> list[Path]:
    """The logs that a text file names, one a line; none where no line is the name of a file: it is a log itself."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        return []
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    named = [path.parent / line.strip() for line in lines if line.strip()]
    return named if any(_is_file(p) for p in named[:100]) else []


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def rows_of(
    path: str, model: str, rate: float | str | None, unit: str | None
) -> list[dict[str, Any]]:
    """One row for each axis of a log; of a log that cannot be read, one that says why.

    Numbers are a JSON object: name → [value, low, high, standard error], in SI.
    """
    from allanite.readers import read
    from allanite.study import improve

    began = perf_counter()
    content = _content(path)
    head = {"file": plain(path), "content": content, "column": "", "status": "done", "remarks": ""}
    try:
        recording = read(path, rate, unit=unit)
    except (AllaniteError, OSError) as error:
        return [{**head, "status": "failed", "remarks": plain(error, 300)}]
    remarks = "; ".join(f.message for f in recording.audit if f.severity == "warning")
    rows = []
    for column in recording:
        row = {**head, "column": column.columns[0], "unit": column.unit, "n": column.n}
        row |= {"rate_hz": column.rate, "duration_s": column.duration}
        try:
            study = improve(column, model)
        except AllaniteError as error:
            rows.append({**row, "status": "failed", "remarks": plain(error, 300)})
            continue
        now = perf_counter()
        rows.append({**row, "remarks": remarks, **_numbers(study), "seconds": now - began})
        began = now
    return rows


def _content(path: str) -> str:
    digest = hashlib.sha256()
    try:
        with Path(path).open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    except OSError:
        return ""
    return digest.hexdigest()


def _numbers(study: Study) -> dict[str, Any]:
    """What a ladder found of an axis."""
    from scipy.special import chdtrc

    fit = study.fit
    numbers: dict[str, list[float | None]] = {}
    labels = zip(fit.model.labels, fit.estimates, fit.model, strict=True)
    for label, values, effect in labels:
        for name, value in values.items():
            if isinstance(value, Estimate) and effect.parameter(name).role != "time":
                low, high = value.interval or (None, None)
                key = name if name == label else f"{label}.{name}"
                numbers[key] = [float(value), low, high, value.std_error]
    mean = float(np.nanmean(np.asarray(fit.recording.rate_samples(), dtype=np.float64)))
    numbers["mean"] = [mean, None, None, None]
    effects = {}
    for rung in study.ladder[1:]:
        added = rung.added
        if added is None or added.kind not in {e.kind for e in fit.model}:
            continue
        free = sum(p.role in {"coefficient", "shape", "time"} for p in added.parameters)
        p = max(rung.trials or TRIALS, TRIALS) * float(
            chdtrc(free, max(2.0 * (rung.risen or 0.0), 0.0))
        )
        effects[added.kind] = min(1.0, p)
    return {
        "model": fit.model.name,
        "verdict": study.verdict,
        "discrepancy_percent": fit.discrepancy.percent,
        "effects": json.dumps(effects),
        "numbers": json.dumps(numbers),
    }


def run_fleet(
    source: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    model: str = "N+B+K",
    rate: float | str | None = None,
    unit: str | None = None,
    scheduler: str | None = None,
    on_done: Callable[[int, int, str], None] | None = None,
) -> list[dict[str, Any]]:
    """Improve a model of every axis of every log, and write a row each.

    A journal beside the table takes each log as it is done: what is in it, by content, is not done again, so that a run
    that was ended in any way goes on where it was.

    Parameters
    ----------
    source : str, Path or sequence
        Folder, pattern, text file with a path a line, or paths.
    out : str or Path
        Table, Parquet or (``.csv``) text.
    model : str
        Where every ladder starts.
    rate, unit : optional
        As of `allanite.read`.
    scheduler : str, optional
        Address of a scheduler of Dask; by default the processors of this machine.
    on_done : callable, optional
        Called with (logs done, logs, path).

    Returns
    -------
    list of dict
        The rows; see `rows_of`.

    Raises
    ------
    InputError
        No logs, or no place for the table.
    """
    target = Path(out)
    check_target(target)
    logs = [str(path) for path in logs_of(source)]
    journal = target.with_name(target.name + JOURNAL)
    with _named(journal):
        known = {row[0]["content"]: row for row in _journal(journal) if row and row[0]["content"]}
    rows: list[dict[str, Any]] = []
    todo = []
    for path in logs:
        before = known.get(_content(path))
        if before is None or before[0].get("asked") != model:
            todo.append(path)
        else:
            rows += [{**row, "file": plain(path)} for row in before]
    done = len(logs) - len(todo)
    with _named(journal), journal.open("a+", encoding="utf-8") as file:
        _close_line(file)
        for path, found in _run(todo, (model, rate, unit), scheduler):
            found = [{**row, "asked": model} for row in found]
            file.write(json.dumps(found) + "\n")
            file.flush()
            os.fsync(file.fileno())
            rows += found
            done += 1
            if on_done is not None:
                on_done(done, len(logs), path)
    rows.sort(key=lambda row: (row["file"], row["column"]))
    write_table(rows, target)
    return rows


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Of a full disk, or one that fails, the system does not say which file."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise InputError(f"{path}: cannot be read or written ({error.strerror or error})") from None


def _close_line(file: TextIO) -> None:
    """End a line that was cut off: what follows would be lost with it."""
    end = file.seek(0, os.SEEK_END)
    if end:
        file.seek(end - 1)
        if file.read(1) != "\n":
            file.write("\n")


def _journal(path: Path) -> Iterator[list[dict[str, Any]]]:
    """Logs that are done; the last line may be cut off where the process was killed."""
    if path.is_file():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(line)
            except ValueError:
                continue


def _run(
    todo: list[str], options: tuple[Any, ...], scheduler: str | None
) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Each log with its rows, as they are done."""
    if scheduler is not None:
        from dask.distributed import Client, as_completed

        with Client(scheduler) as client:
            paths = {client.submit(rows_of, path, *options, pure=False): path for path in todo}
            for task in as_completed(list(paths)):
                yield paths[task], task.result()
        return
    workers = min(len(todo), processors())
    if workers < 2:
        for path in todo:
            yield path, rows_of(path, *options)
        return
    spawn = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=spawn, initializer=_end_with_command) as pool:
        waiting = iter(todo)
        running: dict[Any, str] = {}
        while True:
            while len(running) < AHEAD * workers and (following := next(waiting, None)) is not None:
                running[pool.submit(rows_of, following, *options)] = following
            if not running:
                return
            for task in wait(running, return_when=FIRST_COMPLETED).done:
                path = running.pop(task)
                yield path, task.result()


def _end_with_command() -> None:
    """A worker of a command that was killed would wait for logs for ever, and keep its memory."""

    def follow() -> None:
        if (command := parent_process()) is not None:
            command.join()
            os._exit(1)

    Thread(target=follow, daemon=True).start()


def write_table(rows: list[dict[str, Any]], target: Path) -> None:
    """Rows as Parquet, or as text where the name ends with ``.csv``."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = {name: [row.get(name) for row in rows] for name in names}
    with whole_file(target) as draft:
        if target.suffix.lower() == ".csv":
            import csv

            with draft.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(names)
                writer.writerows(zip(*table.values(), strict=True))
        else:
            import pyarrow as pa
            from pyarrow import parquet

            parquet.write_table(pa.table(table), draft)

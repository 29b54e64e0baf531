"""Logs are read in a process of their own: a damaged one, or one that would fill the memory, takes only that with it."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import AllaniteError, InputError, TooShortError
from allanite.common.memory import free_memory

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.readers._table import Table

__all__ = ["LOOK", "ask"]

#: Of the free memory, what a reader may take.
SHARE = 0.7
#: Stretches of a spark line.
SPARK = 60
#: Seconds between looks at a reader.
LOOK = 0.02


def ask(
    what: str, path: Path, options: dict[str, Any], watch: Callable[[], None] | None = None
) -> Any:
    """Have a process read a log.

    Parameters
    ----------
    what : {"read", "inspect"}
        A recording, or what is understood of each column with a spark line of it.
    path : Path
        The log.
    options : dict
        Arguments of `allanite.read`.
    watch : callable, optional
        Called again and again; what it raises ends the reader.

    Raises
    ------
    InputError
        The log cannot be used, or its reader stopped.
    """
    with tempfile.TemporaryDirectory(prefix="allanite-read-") as folder:
        target = Path(folder) / "found"
        order = json.dumps(
            {"what": what, "path": str(path), "options": options, "target": str(target)}
        )
        paths = os.pathsep.join(p for p in sys.path if p)
        with subprocess.Popen(
            [sys.executable, "-m", "allanite.page.child", order],
            # Closed by the system when this process ends, in whatever way: the reader ends then.
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": paths},
        ) as process:
            try:
                while process.poll() is None:
                    if watch is not None:
                        watch()
                    time.sleep(LOOK)
            finally:
                process.kill()
        if not target.exists():
            raise InputError(
                f"the reader stopped (code {process.returncode}): the file is damaged,"
                " or larger than the memory"
            )
        with target.open("rb") as file:
            found = pickle.load(file)
    if isinstance(found, dict) and "error" in found:
        raise _error(found["error"])
    return found


def _error(said: dict[str, Any]) -> AllaniteError:
    kind = TooShortError if said["short"] else InputError
    error = kind(said["found"], missing=said["missing"], remedy=said["remedy"])
    error.where = said["where"]
    return error


def main(text: str) -> None:
    """The process: read, and leave what was found, or why not."""
    order = json.loads(text)
    target = Path(order["target"])
    threading.Thread(target=_end_with_parent, args=(target.parent,), daemon=True).start()
    _bound()
    try:
        found = _DO[order["what"]](Path(order["path"]), order["options"])
    except AllaniteError as error:
        names = ("found", "missing", "remedy", "where")
        said = {name: getattr(error, name) for name in names}
        found = {"error": {**said, "short": isinstance(error, TooShortError)}}
    except MemoryError:
        needs = "more memory than is free: average it down first, or take fewer columns"
        said = {"found": needs, "missing": None, "remedy": "", "where": order["path"]}
        found = {"error": {**said, "short": False}}
    part = target.with_suffix(".part")
    with part.open("wb") as file:
        pickle.dump(found, file, protocol=5)
    part.rename(target)


def _end_with_parent(folder: Path) -> None:
    """Wait until the input is closed: then its parent is gone, and with it the use of what is read."""
    sys.stdin.buffer.read()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


def _bound() -> None:
    """Leave memory to the others."""
    try:
        import resource
    except ModuleNotFoundError:  # not on this system
        return
    free = free_memory()
    if free < 1e15:
        own = resource.getpagesize() * int(Path("/proc/self/statm").read_text().split()[0])
        most = own + int(SHARE * free)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _read(path: Path, options: dict[str, Any]) -> Any:
    from allanite.readers import read

    units = options.pop("units", None) or {}
    recording = read(path, **options)
    own = dict(zip(recording.columns, recording.units, strict=True))
    return recording.in_units({k: u for k, u in units.items() if u and own.get(k) not in (None, u)})


def _inspect(path: Path, options: dict[str, Any]) -> dict[str, Any]:
    from allanite.page.words import WORDS
    from allanite.readers import read_table
    from allanite.readers.inspection import inspect

    options.pop("units", None)
    seen = inspect(path, **options)
    found = seen.to_dict()
    for told, finding in zip(found["findings"], seen.findings, strict=True):
        told["message"] = finding.worded(WORDS)
    names = [c["name"] for c in found["columns"] if c["role"] != "text"]

    def pick(every: Sequence[str], _: Sequence[str | None]) -> list[int]:
        return [i for i, name in enumerate(every) if name in names]

    try:
        table = read_table(path, pick)
    except AllaniteError:
        return found
    sparks = {name: _spark(table, i) for i, name in enumerate(table.names)}
    for column in found["columns"]:
        column["spark"] = sparks.get(column["name"])
    return found


def _spark(table: Table, at: int) -> list[list[float | None]] | None:
    """Least and largest value of some stretches, from 0 to 1."""
    if table.columns[at] is None:
        return None
    x = np.asarray(table[at], dtype=np.float64)
    x = np.where(np.isfinite(x), x, np.nan)
    if not x.size or np.isnan(x).all():
        return None
    edges = np.arange(min(SPARK, x.size)) * x.size // min(SPARK, x.size)
    low, high = np.fmin.reduceat(x, edges), np.fmax.reduceat(x, edges)
    bottom, span = float(np.nanmin(x)), float(np.nanmax(x) - np.nanmin(x)) or 1.0
    return [
        [round(float(v - bottom) / span, 3) if np.isfinite(v) else None for v in pair]
        for pair in zip(low, high, strict=True)
    ]


_DO: dict[str, Callable[[Path, dict[str, Any]], Any]] = {"read": _read, "inspect": _inspect}

if __name__ == "__main__":
    main(sys.argv[1])

"""The journal of a fleet: finished logs with their rows, a line each, from which a run that was ended goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError

__all__ = ["JOURNAL", "Journal", "read_journal"]

#: What a journal's name ends with; it stands beside the table.
JOURNAL = ".journal"
#: Number of the form of a line.
FORM = 2

Rows = list[dict[str, Any]]


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in errors of the system, which does not do so for a full disk or a broken one."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise InputError(f"{path}: cannot be read or written ({error.strerror or error})") from None


def read_journal(path: Path, on_note: Callable[[str], None]) -> dict[str, Rows]:
    """Return the rows of the finished logs by key; lines that were damaged are reported to `on_note` and skipped."""
    if not path.exists():
        return {}
    with _named(path):
        lines = path.read_bytes().split(b"\n")
    found: dict[str, Rows] = {}
    damaged = []
    for number, line in enumerate(lines, start=1):
        if line:
            try:
                key, rows = _read(line)
                found[key] = rows
            except (ValueError, TypeError, KeyError, RecursionError):
                damaged.append(number)
    if damaged:
        what = "is" if len(damaged) == 1 else f"and {len(damaged) - 1} more are"
        on_note(
            f"{path}: line {damaged[0]} {what} cut off, damaged or of another version, and skipped: its log is done again"
        )
    return found


def _read(line: bytes) -> tuple[str, Rows]:
    value = json.loads(line)
    if value["form"] != FORM or value["check"] != _check(value["key"], value["rows"]):
        raise ValueError(value["form"])
    return value["key"], json.loads(value["rows"])


def _check(key: str, rows: str) -> str:
    return hashlib.sha256(f"{key}\n{rows}".encode()).hexdigest()[:16]


class Journal:
    """The journal, open to take more logs."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with _named(path):
            self._file = path.open("ab+", buffering=0)
            end = self._file.seek(0, os.SEEK_END)
            if end:
                self._file.seek(end - 1)
                if self._file.read(1) != b"\n":
                    # A line that was cut off would take the next one with it.
                    self._write(b"\n")

    def add(self, key: str, rows: Rows) -> None:
        """Write a finished log; it is on the disk when this returns."""
        text = json.dumps(rows)
        line = {"form": FORM, "key": key, "check": _check(key, text), "rows": text}
        with _named(self._path):
            self._write(json.dumps(line).encode() + b"\n")
            os.fsync(self._file.fileno())

    def _write(self, line: bytes) -> None:
        left = memoryview(line)
        while left:
            left = left[self._file.write(left) :]

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

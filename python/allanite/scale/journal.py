"""Journal of a fleet run: finished logs with their rows, one per line, from which an interrupted run continues."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError

#: Suffix of a journal, appended to the name of its table.
JOURNAL = ".journal"
#: Version of the format of a line.
FORMAT_VERSION = 2

#: Rows of a log: one dict per axis.
Rows = list[dict[str, Any]]


@contextmanager
def _naming_errors(path: Path) -> Iterator[None]:
    """Context that raises `InputError` with `path` for an `OSError` without a file name, such as that of a full disk."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise InputError(f"{path}: cannot be read or written ({error.strerror or error})") from None


def read_journal(path: Path, on_note: Callable[[str], None]) -> dict[str, Rows]:
    """Dict from the journal key of each finished log to its rows (list of dicts, one per axis); {} if there is no file.

    Damaged lines are skipped; if there are any, `on_note` is called once with a line of text about them. Raises
    `InputError` if `path` is no file or cannot be read.
    """
    if not path.exists():
        return {}
    if not path.is_file():
        raise InputError(f"{path}: a folder, a pipe or a device, not a journal")
    found: dict[str, Rows] = {}
    damaged = []
    with _naming_errors(path), path.open("rb") as lines:
        for number, line in enumerate(lines, start=1):
            if line != b"\n":
                try:
                    key, rows = _parse_line(line)
                    found[key] = rows
                except (ValueError, TypeError, KeyError, RecursionError):
                    damaged.append(number)
    if damaged:
        what = "is" if len(damaged) == 1 else f"and {len(damaged) - 1} more are"
        on_note(
            f"{path}: line {damaged[0]} {what} truncated, damaged or of another version: their logs are computed again"
        )
    return found


def _parse_line(line: bytes) -> tuple[str, Rows]:
    """Tuple (key of a log, list of its rows) from one line of a journal.

    `ValueError`, `TypeError`, `KeyError` or `RecursionError` for a damaged line or one of another version.
    """
    value = json.loads(line)
    if value["form"] != FORMAT_VERSION or value["check"] != _checksum(value["key"], value["rows"]):
        raise ValueError(value["form"])
    return value["key"], json.loads(value["rows"])


def _checksum(key: str, rows: str) -> str:
    """Text of 16 hexadecimal digits: checksum of a journal line with this key and these rows."""
    return hashlib.sha256(f"{key}\n{rows}".encode()).hexdigest()[:16]


class Journal:
    """Journal file that is open for appending; use it in a ``with`` block."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with _naming_errors(path):
            self._file = path.open("ab+", buffering=0)
            end = self._file.seek(0, os.SEEK_END)
            if end:
                self._file.seek(end - 1)
                if self._file.read(1) != b"\n":
                    # Ends a truncated last line, so that the next line is readable.
                    self._write(b"\n")

    def add(self, key: str, rows: Rows) -> None:
        """Append a finished log; its line is on the disk when this returns."""
        text = json.dumps(rows)
        line = {"form": FORMAT_VERSION, "key": key, "check": _checksum(key, text), "rows": text}
        with _naming_errors(self._path):
            self._write(json.dumps(line).encode() + b"\n")
            os.fsync(self._file.fileno())

    def _write(self, line: bytes) -> None:
        """Write all bytes of a line, with as many system calls as needed."""
        left = memoryview(line)
        while left:
            left = left[self._file.write(left) :]

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

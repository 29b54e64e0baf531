"""Logs from standard input, as in ``allanite fit -``."""

from __future__ import annotations

import shutil
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import InputError, about
from allanite.readers import FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator

PIPE = "-"
NAME = "standard input"


@contextmanager
def log_file(path: str) -> Iterator[Path]:
    """Context with the path of a log. Standard input is copied to a temporary file, which is deleted at the end."""
    if path != PIPE:
        yield Path(path)
        return
    if sys.stdin is None:
        raise InputError("standard input is closed: there is no log to read")
    stream = sys.stdin.buffer
    # A pipe that begins with no signature of a format is text.
    head = stream.read(max(map(len, FORMATS.magic)))
    suffix = next((s for magic, s in FORMATS.magic.items() if head.startswith(magic)), ".csv")
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        spool = Path(folder) / f"{NAME}{suffix}"
        with spool.open("wb") as file:
            file.write(head)
            shutil.copyfileobj(stream, file)
        yield spool


@contextmanager
def named(file: Path, path: str) -> Iterator[None]:
    """Context in which errors name standard input instead of its temporary file."""
    with about(NAME if path == PIPE else None, instead=file):
        yield

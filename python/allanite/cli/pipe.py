"""Logs from standard input, as in ``allanite fit -``."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import IO

from allanite.common.errors import InputError, about
from allanite.common.memory import bytes_text
from allanite.readers import FORMATS

#: Name of a log on the command line that stands for standard input, and its name in messages.
STANDARD_INPUT = "-"
INPUT_NAME = "standard input"
#: Bytes that are copied at a time.
BLOCK = 1 << 20
#: Largest part of the free space of the temporary folder that a copy may take: a pipe may have no end. Chosen by judgment;
#: not measured.
MAX_SPACE_SHARE = 0.5


def shown_path(path: str) -> str:
    """Path of a log as in messages: ``standard input`` for ``-``, otherwise the path itself."""
    return INPUT_NAME if path == STANDARD_INPUT else path


@contextmanager
def log_file(path: str) -> Iterator[Path]:
    """Context with the path of a log; standard input (``-``) is copied to a temporary file, which is deleted at the end.

    Raises `InputError` if standard input is closed or too long. Other paths are not checked.
    """
    if path != STANDARD_INPUT:
        yield Path(path)
        return
    if sys.stdin is None:
        raise InputError("standard input is closed: there is no log to read")
    stream = sys.stdin.buffer
    # A pipe that begins with no signature of a format is text.
    head = stream.read(max(map(len, FORMATS.magic)))
    suffix = next((s for magic, s in FORMATS.magic.items() if head.startswith(magic)), ".csv")
    with TemporaryDirectory(prefix="allanite-") as folder:
        spool = Path(folder) / f"{INPUT_NAME}{suffix}"
        _spool_input(head, stream, spool)
        yield spool


def _spool_input(head: bytes, stream: IO[bytes], spool: Path) -> None:
    """Copy standard input to the new file `spool`: `head`, the bytes already read, then the rest of `stream`.

    An empty `head` means that the input is empty; the file is then empty, too. Raises `InputError` if the data exceed
    half of the free space, or the file cannot be written.
    """
    folder = gettempdir()
    try:
        most = MAX_SPACE_SHARE * shutil.disk_usage(folder).free
        with spool.open("wb") as file:
            block = head
            while block:
                file.write(block)
                if file.tell() > most:
                    raise InputError(
                        f"{INPUT_NAME} is longer than {bytes_text(most)}, half of the free space of {folder}: give the name"
                        " of a file"
                    )
                block = stream.read(BLOCK)
    except OSError as error:
        raise InputError(
            f"{INPUT_NAME} cannot be copied to {folder} ({error.strerror or error}): give the name of a file"
        ) from None


@contextmanager
def errors_name_input(file: Path, path: str) -> Iterator[None]:
    """Context for reading `file`, in which errors name standard input instead if `path` is ``-``."""
    with about(INPUT_NAME if path == STANDARD_INPUT else None, instead=file):
        yield

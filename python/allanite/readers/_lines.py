"""Lines of a text log, with a limit on their length so that no line can fill the memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import IO

from allanite.common.errors import InputError

#: Maximum length of a line, bytes. Lines of RINEX have 80 bytes, of NovAtel about 500.
MAX_LINE_BYTES = 1 << 16


#: Number of first bytes of a text log from which its format is recognized.
HEAD = 8192


def head_of(path: Path) -> bytes:
    """Bytes at the start of a file, from which its format is recognized: 8192, or fewer if the file is shorter."""
    with path.open("rb") as stream:
        return stream.read(HEAD)


def lines_of(stream: IO[bytes]) -> Iterator[bytes]:
    """Yield the lines of an open file with their line ends; raises `InputError` for a line over 64 kB: no text."""
    number = 0
    while line := stream.readline(MAX_LINE_BYTES + 1):
        number += 1
        if len(line) > MAX_LINE_BYTES:
            raise InputError(f"line {number} is longer than 64 kB: damaged, or not a text log")
        yield line

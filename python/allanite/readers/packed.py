"""Logs packed by gzip: unpacked into a file that disappears after reading."""

from __future__ import annotations

import gzip
import shutil
import tempfile
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import AllaniteError, InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["is_packed", "unpacked"]


def is_packed(path: Path) -> bool:
    """Whether a file is packed by gzip, by its first bytes."""
    with path.open("rb") as stream:
        return stream.read(2) == b"\x1f\x8b"


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Give the path of the file inside; errors speak of the packed one.

    Raises
    ------
    InputError
        A damaged or truncated file.
    """
    inner = path.stem if path.suffix.lower() == ".gz" else path.name
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        target = Path(folder) / (inner if Path(inner).suffix else f"{inner}.csv")
        try:
            with gzip.open(path, "rb") as source, target.open("wb") as sink:
                shutil.copyfileobj(source, sink, 1 << 20)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise InputError(f"{path}: damaged or truncated gzip file ({error})") from None
        try:
            yield target
        except AllaniteError as error:
            raise type(error)(str(error).replace(str(target), str(path))) from None

"""Logs packed by gzip, or several in a ZIP archive: unpacked into a file that disappears after reading."""

from __future__ import annotations

import gzip
import tempfile
import zipfile
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

from allanite.common.errors import InputError, about
from allanite.common.memory import require_memory

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["is_packed", "member", "unpacked"]


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
                _copy(source, sink)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise InputError(f"damaged or truncated gzip file ({error})") from None
        with about(path, instead=target):
            yield target


@contextmanager
def member(path: Path, topics: Sequence[str]) -> Iterator[Path]:
    """Give the path of one log of an archive, as telephones' loggers send them: a text file a sensor.

    Without a topic it is the gyroscope's, or else the accelerometer's, or the only one.

    Raises
    ------
    InputError
        A damaged archive, no text log in it, or several and none named; they are listed.
    """
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        try:
            with zipfile.ZipFile(path) as archive:
                # phyphox describes the telephone in meta/; macOS adds shadows.
                logs = {
                    Path(name).stem: name
                    for name in archive.namelist()
                    if name.lower().endswith((".csv", ".txt"))
                    and not name.startswith(("meta/", "__MACOSX/"))
                    and Path(name).stem.lower() not in ("metadata", "annotation")
                }
                chosen = _one(logs, topics)
                target = Path(folder) / f"{chosen}.csv"
                with archive.open(logs[chosen]) as source, target.open("wb") as sink:
                    _copy(source, sink)
        except (
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            NotImplementedError,
            RuntimeError,
        ) as error:
            raise InputError(f"damaged or truncated ZIP archive ({error})") from None
        with about(path, instead=target):
            yield target


def _one(logs: dict[str, str], topics: Sequence[str]) -> str:
    listed = ", ".join(sorted(logs)) or "none"
    if topics:
        if len(topics) > 1 or topics[0] not in logs:
            raise InputError(
                f"no log {', '.join(topics)} in it, but {listed}",
                missing="topic",
                remedy="; choose one with {topic}",
            )
        return topics[0]
    for word in ("gyro", "acc", "linear"):
        found = [name for name in logs if word in name.lower() and "uncal" not in name.lower()]
        if found:
            return min(found, key=len)
    if len(logs) != 1:
        raise InputError(
            f"several logs in it: {listed}", missing="topic", remedy="; choose one with {topic}"
        )
    return next(iter(logs))


def _copy(source: IO[bytes] | gzip.GzipFile, sink: IO[bytes]) -> None:
    """Packed text can be a thousandth of what it holds: the budget is looked at on the way."""
    size = 0
    while piece := source.read(1 << 20):
        size += len(piece)
        require_memory(size, "it unpacked")
        sink.write(piece)

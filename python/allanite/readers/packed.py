"""Logs that are compressed by gzip or in a ZIP archive: unpacked into a temporary file for reading."""

from __future__ import annotations

import gzip
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from allanite.common.errors import InputError, about
from allanite.common.memory import require_memory
from allanite.readers._lines import head_of


def is_packed(path: Path) -> bool:
    """True if the file at `path` begins with the signature of gzip."""
    return head_of(path).startswith(b"\x1f\x8b")


@contextmanager
def temporary_file(path: Path, name: str) -> Iterator[Path]:
    """Context with the path of a file `name`, yet to be written, in a temporary folder; errors name the log `path`."""
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        target = Path(folder) / name
        with about(path, instead=target):
            yield target


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Context with the path of the temporary unpacked file; errors name the compressed file.

    Raises `InputError` for a damaged file, a gzip file within it, or one that exceeds the memory budget unpacked.
    """
    inner = path.stem if path.suffix.lower() == ".gz" else path.name
    with temporary_file(path, inner if Path(inner).suffix else f"{inner}.csv") as target:
        try:
            with gzip.open(path, "rb") as source, target.open("wb") as sink:
                _copy_stream(source, sink)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise InputError(f"damaged or truncated gzip file ({error})") from None
        if is_packed(target):
            # Each file of a chain may be as large as the budget, and all of them are on the disk together.
            raise InputError("a gzip file within a gzip file: unpack it with gunzip")
        yield target


@contextmanager
def member(path: Path, topics: Sequence[str]) -> Iterator[Path]:
    """Context with the path of one log of a ZIP archive, unpacked to a temporary file; errors name the archive.

    Phone apps write such archives, with one text file per sensor. Without a topic, the gyroscope is read, or else the
    accelerometer, or the only log. Raises `InputError` if the archive is damaged, exceeds the memory budget or has no
    such log.
    """
    with temporary_file(path, "log.csv") as target:
        try:
            with zipfile.ZipFile(path) as archive:
                # phyphox describes the phone in meta/; macOS adds files in __MACOSX/.
                logs = {
                    Path(name).stem: name
                    for name in archive.namelist()
                    if name.lower().endswith((".csv", ".txt"))
                    and not name.startswith(("meta/", "__MACOSX/"))
                    and Path(name).stem.lower() not in ("metadata", "annotation")
                }
                chosen = _log_to_read(logs, topics)
                with archive.open(logs[chosen]) as source, target.open("wb") as sink:
                    _copy_stream(source, sink)
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
            raise InputError(f"damaged or truncated ZIP archive ({error})") from None
        yield target


def _log_to_read(logs: dict[str, str], topics: Sequence[str]) -> str:
    """Key in `logs` of the log to read: the given topic, or else a gyroscope, an accelerometer, or the only log.

    A sensor is recognized by ``gyro``, ``acc`` or ``linear`` in the name, in this order. Names with ``uncal`` are
    skipped, and the shortest of several names is chosen. Raises `InputError` for no log, several topics, an unknown
    topic, and several logs without such a name.
    """
    if not logs:
        raise InputError("no text log in the archive")
    listed = ", ".join(sorted(logs))
    if topics:
        if len(topics) > 1 or topics[0] not in logs:
            raise InputError(
                f"no log {', '.join(topics)} in the archive, only {listed}",
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
            f"several logs in the archive: {listed}",
            missing="topic",
            remedy="; choose one with {topic}",
        )
    return next(iter(logs))


def _copy_stream(source: IO[bytes] | gzip.GzipFile, sink: IO[bytes]) -> None:
    """Copy a stream to another in blocks of 1 MB; raises `InputError` if the copy exceeds the memory budget."""
    size = 0
    while piece := source.read(1 << 20):
        size += len(piece)
        require_memory(size, "the unpacked log")
        sink.write(piece)

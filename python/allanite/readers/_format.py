"""Declaration of a log format, and the collection of all formats."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError
from allanite.common.extensions import EntryPoints, values_of_modules
from allanite.readers._table import Table

#: Group of the entry points of installed packages.
ENTRY_POINTS = "allanite.readers"


@dataclass(frozen=True, slots=True)
class LogFormat:
    """One log format: how its files are recognized, and the function that reads them.

    Attributes
    ----------
    title : str
        Name of the format in the documentation: ``ROS bag``.
    read : callable
        ``read(path, pick)`` returns a `Table`. A format with topics also takes ``topics``, a sequence of names.
    suffixes : tuple of str
        Suffixes of its files: ``(".bag", ".mcap")``. They must not belong to another format.
    recognizes : callable, optional
        ``recognizes(head)`` is true if the first bytes of a text log have this format, whatever its suffix. Exactly one
        format may recognize a log.
    log_in : callable, optional
        ``log_in(folder)`` is the log of this format in a folder: a file in it, or the folder if the format reads whole
        folders; None for other folders.
    magic : tuple of (bytes, str)
        First bytes of a file, and the suffix with which a log from a pipe is stored.
    has_topics : bool
        Whether a log can hold several topics.
    reads : str
        Contents that become columns, for the documentation.
    """

    title: str
    read: Callable[..., Table]
    suffixes: tuple[str, ...] = ()
    recognizes: Callable[[bytes], bool] | None = None
    log_in: Callable[[Path], Path | None] | None = None
    magic: tuple[tuple[bytes, str], ...] = ()
    has_topics: bool = False
    reads: str = ""


class Formats:
    """All log formats: from modules of the given packages, then from installed packages, loaded at first use."""

    def __init__(self, *packages: str) -> None:
        self._formats: list[LogFormat] = list(values_of_modules("FORMAT", *packages))
        self._installed = EntryPoints(ENTRY_POINTS, "log format", self._add)

    def __iter__(self) -> Iterator[LogFormat]:
        self._installed.load()
        return iter(tuple(self._formats))

    def of_suffix(self, suffix: str) -> LogFormat | None:
        """Format of files with this suffix, or None. The suffix is in lower case and begins with a dot."""
        return next((one for one in self if suffix in one.suffixes), None)

    def of_head(self, head: bytes) -> LogFormat | None:
        """First format that recognizes the first bytes of a log; None for binary data, and if no format recognizes them."""
        if b"\0" in head:
            return None
        return next((one for one in self if one.recognizes and one.recognizes(head)), None)

    def of_folder(self, folder: Path) -> tuple[LogFormat, Path] | None:
        """Pair (format, log) of a folder, or None. A format that reads the whole folder takes precedence."""
        found = [(one, log) for one in self if one.log_in and (log := one.log_in(folder))]
        return min(found, key=lambda pair: pair[1] != folder, default=None)

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Tuple of the suffixes of all formats, each with its dot."""
        return tuple(suffix for one in self for suffix in one.suffixes)

    @property
    def magic(self) -> dict[bytes, str]:
        """Dict from the first bytes of a kind of file to the suffix of its format."""
        return {head: suffix for one in self for head, suffix in one.magic}

    def _add(self, log_format: Any) -> None:
        """Append a format. Raises `InputError` if it is no `LogFormat`, or if one of its suffixes is already used."""
        if not isinstance(log_format, LogFormat):
            raise InputError(f"{log_format!r} is not an allanite.readers.LogFormat")
        taken = set(log_format.suffixes) & {s for one in self._formats for s in one.suffixes}
        if taken:
            raise InputError(f"the suffix {min(taken)} belongs to another format")
        self._formats.append(log_format)

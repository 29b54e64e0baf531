"""Files that are there whole or not at all, and temporary folders that outlive no process for long.

A full disk, a kill or an error leaves what was there before.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["OwnedFolder", "check_target", "exists", "is_file", "whole_file"]


def is_file(text: str | Path) -> bool:
    """Whether a text names a file; what the system refuses to look up (too long, or with a null) names none."""
    try:
        return Path(text).is_file()
    except (OSError, ValueError):
        return False


def exists(text: str | Path) -> bool:
    """Whether a text names a file or a folder."""
    try:
        return Path(text).exists()
    except (OSError, ValueError):
        return False


def check_target(path: str | Path) -> None:
    """Refuse a file that cannot be written before anything long is computed for it."""
    target = Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: the folder {target.parent} does not exist")
    if target.is_dir():
        raise InputError(f"{target} is a folder: give the name of a file")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path that takes the place of `path` when the block ends well.

    Raises
    ------
    InputError
        No such folder, or the file cannot be written; the message names it.
    """
    check_target(path)
    # Of a link what it points to is written; a device or a pipe cannot be replaced.
    target = Path(path).resolve()
    replaced = target.is_file() or not target.exists()
    draft = target
    try:
        if replaced:
            _sweep(target)
            # Named before it is made: an interrupt as soon as it is there leaves none.
            name = f".{target.stem}-{os.getpid()}-{token_hex(4)}{target.suffix}"
            draft = target.with_name(name)
            draft.touch(mode=0o600, exist_ok=False)
        yield draft
        if replaced:
            # The draft is private; a result is as readable as any other new file.
            mask = os.umask(0)
            os.umask(mask)
            draft.chmod(0o666 & ~mask)
            draft.replace(target)
    except OSError as error:
        # Of a full disk the system does not say which file.
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        if draft != target:
            draft.unlink(missing_ok=True)


class OwnedFolder:
    """A temporary folder, removed when it is closed, or by `remove_abandoned` after its process was killed.

    The folder holds a locked file as long as its process lives. A number of a process would not do: it is given
    again, and names another process in another container.
    """

    LOCK = ".owned"

    def __init__(self, kind: str) -> None:
        self._folder = TemporaryDirectory(prefix=_prefix(kind))
        self.path = Path(self._folder.name)
        new = self.path / f"{self.LOCK}-new"
        new.touch()
        self._lock = new.open("rb")
        _lock(self._lock.fileno())
        new.rename(self.path / self.LOCK)  # under its name it has always been locked

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder."""
        self._lock.close()
        self._folder.cleanup()

    @classmethod
    def remove_abandoned(cls, kind: str) -> None:
        """Remove the folders of this kind and user whose processes were killed."""
        for folder in Path(gettempdir()).glob(f"{_prefix(kind)}*"):
            with suppress(OSError):
                if folder.is_symlink() or not _is_own(folder):
                    continue
                lock = folder / cls.LOCK
                if os.name == "posix":
                    with lock.open("rb") as file:
                        _lock(file.fileno())
                        rmtree(folder)
                else:
                    lock.unlink()  # fails as long as its process has it open
                    rmtree(folder)


def _prefix(kind: str) -> str:
    return f"allanite-{kind}-"


def _is_own(path: Path) -> bool:
    return os.name != "posix" or path.stat().st_uid == os.getuid()


def _lock(file: int) -> None:
    """Lock a file for as long as it is open; where a file that is open cannot be removed, nothing is needed.

    Raises
    ------
    OSError
        Another process has locked it.
    """
    if os.name == "posix":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _sweep(target: Path) -> None:
    """Remove the drafts of processes that were killed before they could."""
    pattern = re.compile(rf"\.{re.escape(target.stem)}-(\d+)-\w+{re.escape(target.suffix)}")
    with suppress(OSError):
        for path in target.parent.iterdir():
            match = pattern.fullmatch(path.name)
            if match and not _alive(int(match[1])):
                path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    if os.name != "posix":
        return True  # there a signal 0 would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True

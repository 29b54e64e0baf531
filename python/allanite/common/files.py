"""Write files as a whole or not at all, and clean up temporary folders of killed processes.

After a full disk, a kill or an error, the previous file is unchanged.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir

from allanite.common.errors import InputError


def is_file(text: str | Path) -> bool:
    """True if a file with this path exists. False also if the text is too long for a path or has a null character."""
    return os.path.isfile(text)  # noqa: PTH113 (`Path.is_file` raises OSError for a long text)


def exists(text: str | Path) -> bool:
    """True if a file or folder with this path exists. False also if the text is too long or has a null character."""
    return os.path.exists(text)  # noqa: PTH110 (`Path.exists` raises OSError for a long text)


def check_target(path: str | Path) -> None:
    """Raise `InputError` if the folder of a file does not exist, or if the path is a folder; nothing is written."""
    target = Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: the folder {target.parent} does not exist")
    if target.is_dir():
        raise InputError(f"{target} is a folder: give the name of a file")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Context with the path of a temporary file to write; the file replaces `path` if the block ends without an error.

    A device or a pipe is written directly. The target of a link is replaced, not the link. Raises `InputError` if the
    file cannot be written.
    """
    check_target(path)
    # A link is resolved, so that its target is written. A device or a pipe is written directly. `Path.resolve` fails for a
    # loop of links.
    target = Path(os.path.realpath(path))
    replaced = target.is_file() or not target.exists()
    draft = target
    try:
        if replaced:
            _remove_abandoned_drafts(target)
            # The name is assigned before the file exists, so that an interrupt right after its creation removes it.
            name = f".{target.stem}-{os.getpid()}-{token_hex(4)}{target.suffix}"
            draft = target.with_name(name)
            draft.touch(mode=0o600, exist_ok=False)
        yield draft
        if replaced:
            # The draft is private. The result gets the usual permissions of a new file.
            mask = os.umask(0)
            os.umask(mask)
            draft.chmod(0o666 & ~mask)
            draft.replace(target)
    except OSError as error:
        # The system's error for a full disk does not name the file.
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        if draft != target:
            draft.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8 as a whole or not at all, as `whole_file` does."""
    with whole_file(path) as draft:
        draft.write_text(text, encoding="utf-8")


class OwnedFolder:
    """A temporary folder that is removed when it is closed, or by `remove_abandoned` if its process was killed.

    The folder holds a file that is locked as long as its process lives. A process number would not be enough: numbers are
    reused, and containers have their own numbers.
    """

    LOCK = ".owned"

    def __init__(self, kind: str) -> None:
        self._folder = TemporaryDirectory(prefix=_folder_prefix(kind))
        self.path = Path(self._folder.name)
        new = self.path / f"{self.LOCK}-new"
        new.touch()
        self._lock = new.open("rb")
        _lock(self._lock.fileno())
        new.rename(self.path / self.LOCK)  # the file never exists unlocked under its final name

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Unlock and remove the folder with its files."""
        self._lock.close()
        self._folder.cleanup()

    @classmethod
    def remove_abandoned(cls, kind: str) -> None:
        """Delete the temporary folders of this kind that belong to this user and whose processes have ended.

        Links, and folders that cannot be deleted, are skipped.
        """
        for folder in Path(gettempdir()).glob(f"{_folder_prefix(kind)}*"):
            with suppress(OSError):
                if folder.is_symlink() or not _has_own_user(folder):
                    continue
                lock = folder / cls.LOCK
                if os.name == "posix":
                    with lock.open("rb") as file:
                        _lock(file.fileno())
                        rmtree(folder)
                else:
                    lock.unlink()  # on Windows, this fails as long as the process has the file open
                    rmtree(folder)


def _folder_prefix(kind: str) -> str:
    """First part of the names of temporary folders of this kind: ``"allanite-KIND-"``."""
    return f"allanite-{kind}-"


def _has_own_user(path: Path) -> bool:
    """True if the file or folder belongs to the user of this process; always True on Windows."""
    return os.name != "posix" or path.stat().st_uid == os.getuid()


def _lock(file: int) -> None:
    """Lock an open file until it is closed; raises `OSError` if another process has locked it.

    Does nothing on Windows, where an open file cannot be removed.
    """
    if os.name == "posix":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _remove_abandoned_drafts(target: Path) -> None:
    """Remove the temporary files of `whole_file` for this target whose processes no longer run."""
    pattern = re.compile(rf"\.{re.escape(target.stem)}-(\d+)-\w+{re.escape(target.suffix)}")
    with suppress(OSError):
        for path in target.parent.iterdir():
            match = pattern.fullmatch(path.name)
            if match and not _is_running(int(match[1])):
                path.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """True if a process with this number runs, or if the system does not tell; always True on Windows."""
    if os.name != "posix":
        return True  # on Windows, os.kill(process, 0) would end the process
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True

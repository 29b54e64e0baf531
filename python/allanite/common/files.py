"""Files that are there whole or not at all: a full disk, a kill or an error leaves what was there before."""

from __future__ import annotations

import os
import re
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["check_target", "whole_file"]


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

"""An unexpected error: one line, and a file to report it with."""

from __future__ import annotations

import math
import platform
import sys
import tempfile
import traceback
from pathlib import Path

from allanite.common.memory import address_space

__all__ = ["told"]


def told(error: BaseException) -> str:
    """Describe an error of allanite itself; where it happened is written to a temporary file."""
    what = f"{type(error).__name__}: {str(error)[:120]}"
    if address_space() < math.inf:
        # Libraries that cannot be loaded, or start no thread, raise what they like.
        what += f"; the address space is limited to {address_space() / 1e6:.0f} MB, which may be the cause"
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            prefix="allanite-error-",
            suffix=".txt",
            encoding="utf-8",
            errors="replace",
            delete=False,
        ) as file:
            file.write(_details(error))
    except OSError:
        return f"an error of allanite itself ({what}): please report it with the command"
    return (
        f"an error of allanite itself ({what}): please report it with {Path(file.name)}, which"
        " holds no samples"
    )


def _version() -> str:
    try:
        from allanite._kernels import version
    except ImportError:  # which may be the very error that is told
        return "without its compiled core"
    return version()


def _details(error: BaseException) -> str:
    where = "".join(traceback.format_exception(error))
    return (
        f"allanite {_version()}, Python {platform.python_version()}, {platform.platform()}\n"
        f"{' '.join(['allanite', *sys.argv[1:]])}\n\n{where}"
    )

"""Messages for internal errors of allanite: one line, and a file for the bug report."""

from __future__ import annotations

import math
import platform
import sys
import tempfile
import traceback
from pathlib import Path

from allanite.common.memory import address_space


def internal_error_message(error: BaseException) -> str:
    """Text about an internal error; the traceback is in a temporary file, which the text names if it could be written."""
    what = f"{type(error).__name__}: {str(error)[:120]}"
    if address_space() < math.inf:
        # Libraries that cannot be loaded, or cannot start a thread, raise all kinds of errors.
        what += f"; a possible cause is the address space, which is limited to {address_space() / 1e6:.0f} MB"
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            prefix="allanite-error-",
            suffix=".txt",
            encoding="utf-8",
            errors="replace",
            delete=False,
        ) as file:
            file.write(_report_text(error))
    except OSError:
        return f"an internal error of allanite ({what}): please report it with the command line"
    return (
        f"an internal error of allanite ({what}): please report it and attach {Path(file.name)}, which"
        " holds no samples"
    )


def _version_text() -> str:
    """Version of allanite; "without its compiled core" if that is missing."""
    try:
        from allanite._kernels import version
    except ImportError:  # a missing core may be the reported error
        return "without its compiled core"
    return version()


def _report_text(error: BaseException) -> str:
    """Text of the error file: versions, command line and traceback."""
    where = "".join(traceback.format_exception(error))
    return (
        f"allanite {_version_text()}, Python {platform.python_version()}, {platform.platform()}\n"
        f"{' '.join(['allanite', *sys.argv[1:]])}\n\n{where}"
    )

"""Start Python child processes that never import code from the working directory."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["child_environment", "python_command", "safe_path"]


def python_command(*arguments: str) -> list[str]:
    """Return the command line of a Python child that ignores modules in the working directory.

    Without ``-P``, ``python -m`` and ``python -c`` put the working directory first on ``sys.path``: a file
    ``json.py`` beside a log would be executed.
    """
    return [sys.executable, "-P", *arguments]


def child_environment() -> dict[str, str]:
    """Return this process's environment with ``PYTHONSAFEPATH`` set, for the children of a child."""
    return {**os.environ, "PYTHONSAFEPATH": "1"}


@contextmanager
def safe_path() -> Iterator[None]:
    """Set ``PYTHONSAFEPATH`` in this process while a library starts Python children (multiprocessing, Dask)."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("PYTHONSAFEPATH", None)
        else:
            os.environ["PYTHONSAFEPATH"] = before

"""Start Python child processes that never import code from the working directory."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


def python_command(*arguments: str) -> list[str]:
    """Command of a Python child process that ignores modules in the working directory.

    Without ``-P``, ``python -m`` and ``python -c`` put the working directory first on ``sys.path``. A file ``json.py``
    in the folder of a log would then be executed.
    """
    return [sys.executable, "-P", *arguments]


def child_environment() -> dict[str, str]:
    """Dict of this process's environment variables, and ``PYTHONSAFEPATH`` = 1. Grandchildren inherit the variable."""
    return {**os.environ, "PYTHONSAFEPATH": "1"}


@contextmanager
def safe_path() -> Iterator[None]:
    """Context in which ``PYTHONSAFEPATH`` is 1, for libraries that start Python children (multiprocessing, Dask)."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("PYTHONSAFEPATH", None)
        else:
            os.environ["PYTHONSAFEPATH"] = before

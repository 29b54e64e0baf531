"""Helpers of the readers of text formats: first lines, time stamps, and text rewritten as a plain table."""

from __future__ import annotations

import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import about

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

__all__ = ["MJD_OF_1970", "date_times", "first_lines", "rewritten", "spacing_notes"]

#: Modified Julian Date of 1970-01-01, days.
MJD_OF_1970 = 40587


def first_lines(head: bytes) -> list[str]:
    """Return the whole lines of the first bytes of a log, without blank lines."""
    text = head.decode("utf-8", "replace").lstrip("\ufeff")
    lines = text.splitlines()
    if len(lines) > 1 and not text.endswith(("\n", "\r")):
        lines.pop()  # cut off by the end of the bytes
    return [line.strip() for line in lines if line.strip()]


def date_times(seconds: Iterable[float]) -> NDArray[np.datetime64]:
    """Return seconds since an epoch as date-times, whose unit no reader has to guess: shape (n,)."""
    found = np.asarray(list(seconds), dtype=np.float64)
    whole = np.floor(found)
    ns = whole.astype(np.int64) * 10**9 + np.rint((found - whole) * 1e9).astype(np.int64)
    return ns.astype("datetime64[ns]")


def spacing_notes(seconds: NDArray[np.float64]) -> list[str]:
    """Return a remark on the spacing of the lines of a time server, if they are not all as far apart.

    A server writes a line when a packet arrives.
    """
    steps = np.diff(seconds)
    if steps.size == 0 or steps.min() == steps.max():
        return []
    usual = float(np.median(steps))
    return [f"lines are {usual:.6g} s apart, from {steps.min():.6g} to {steps.max():.6g} s"]


@contextmanager
def rewritten(path: Path, lines: Iterable[str]) -> Iterator[Path]:
    """Give the path of a temporary text log with these lines; errors name the original file.

    Row numbers in errors are right if each line stands for one line of the original.
    """
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        target = Path(folder) / "log.csv"
        with target.open("w", encoding="utf-8", newline="\n") as sink:
            sink.writelines(f"{line}\n" for line in lines)
        with about(path, instead=target):
            yield target

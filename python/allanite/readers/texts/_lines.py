"""Helpers of the readers of text formats: first lines, time stamps, and text rewritten as a plain table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._lines import head_of
from allanite.readers._table import Table
from allanite.readers.packed import temporary_file
from allanite.readers.text import all_numbers
from allanite.readers.text import read as read_text

#: Modified Julian Date of 1970-01-01, days.
MJD_OF_1970 = 40587
#: Seconds before and after 1970 that 64-bit date-times in nanoseconds can hold, less one second for the rounding.
MAX_SECONDS_OF_DATES = 2.0**63 / 1e9 - 1.0
#: Seconds per day. The clock of a terminal restarts at midnight.
DAY = 86_400.0
# Source: docs.arduino.cc, "Serial Monitor": IDE 1.8 and 2 with "Show timestamp".
TERMINAL_NOTE = "the time is that at which the terminal received each line"
STAMP = re.compile(r"^(?P<clock>\d\d:\d\d:\d\d\.\d{3}) ?-> ?")


def first_lines(head: bytes) -> list[str]:
    """Complete lines in the first bytes of a log, stripped, without blank lines.

    The last line is left out if it has no line end, unless it is the only line.
    """
    text = head.decode("utf-8", "replace").lstrip("\ufeff")
    lines = text.splitlines()
    if len(lines) > 1 and not text.endswith(("\n", "\r")):
        lines.pop()  # cut off by the end of the bytes
    return [line.strip() for line in lines if line.strip()]


def chosen_source(
    rows: Mapping[str, Sequence[Any]], topics: Sequence[str], what: str
) -> tuple[str, list[str]]:
    """Name of the source to read from a log of several clocks, and at most one note on the others.

    The source is the one in `topics`, or else the one with most `rows`. `what` is its noun in messages, such as
    ``"peer"``. Raises `InputError` for several topics or an unknown one.
    """
    listed = {name: f"{plain(name)} ({len(own)} rows)" for name, own in rows.items()}
    if len(topics) > 1 or any(name not in rows for name in topics):
        raise InputError(
            f"no {what} {plain(' and '.join(topics))} in this log, which holds {', '.join(listed.values())}: name one"
        )
    chosen = topics[0] if topics else max(rows, key=lambda name: len(rows[name]))
    del listed[chosen]
    others = ", ".join(listed.values())
    note = f"{what}s not read: {others}; to read another one, give its name as the topic"
    return chosen, [note] if others else []


def text_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a UTF-8 text file with their line ends; other bytes become U+FFFD."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        yield from stream


def numbered_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (number, line) for each line of a text that is not blank; numbers count from 1, lines are stripped."""
    for number, line in enumerate(text_lines(path), start=1):
        if text := line.strip():
            yield number, text


def date_times(seconds: Iterable[float]) -> NDArray[np.datetime64]:
    """Date-times (datetime64[ns]) from seconds since 1970.

    Raises `InputError` for a missing date (NaN), and outside of the years 1678 to 2262.
    """
    found = np.asarray(list(seconds), dtype=np.float64)
    if not np.all(np.abs(found) < MAX_SECONDS_OF_DATES):  # also false for NaN
        raise InputError("a date is missing or outside of the years 1678 to 2262")
    whole = np.floor(found)
    ns = whole.astype(np.int64) * 10**9 + np.rint((found - whole) * 1e9).astype(np.int64)
    return ns.astype("datetime64[ns]")


def terminal_times(clocks: Iterable[str]) -> NDArray[np.datetime64]:
    """Array of date-times (datetime64[ns]) from 1970-01-01 on of texts ``hh:mm:ss.sss``; a fall by 12 h adds a day."""
    parts = np.array([clock.split(":") for clock in clocks], dtype=np.float64)
    seconds = parts.reshape(-1, 3) @ [3600.0, 60.0, 1.0]
    seconds[1:] += DAY * np.cumsum(np.diff(seconds) < -DAY / 2)
    return date_times(seconds)


def spacing_notes(seconds: Array) -> list[str]:
    """At most one note: median, least and largest interval between the lines, in s, if they differ in six digits."""
    steps = np.diff(seconds)
    if steps.size == 0 or steps.min() == steps.max():
        return []
    usual = float(np.median(steps))
    spacings = (f"{usual:.6g}", f"{steps.min():.6g}", f"{steps.max():.6g}")
    if len(set(spacings)) == 1:
        return []
    return [f"lines are {spacings[0]} s apart, from {spacings[1]} to {spacings[2]} s"]


def is_utf16(path: Path) -> bool:
    """True if a file begins with the byte order mark of UTF-16, which Excel's "Unicode text" and PowerShell write."""
    begin = head_of(path)[:4]
    return begin[:2] in (b"\xff\xfe", b"\xfe\xff") and begin != b"\xff\xfe\0\0"


def utf16_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a text in UTF-16, without line ends."""
    with path.open(encoding="utf-16", errors="replace") as stream:
        for line in stream:
            yield line.rstrip("\n")


@contextmanager
def rewritten(path: Path, lines: Iterable[str]) -> Iterator[Path]:
    """Context with the path of a temporary text file with the given lines; errors name the original file.

    Row numbers in errors are right if each line stands for one line of the original.
    """
    with temporary_file(path, "log.csv") as target:
        with target.open("w", encoding="utf-8", newline="\n") as sink:
            sink.writelines(f"{line}\n" for line in lines)
        yield target


def read_rewritten(path: Path, lines: Iterable[str]) -> Table:
    """`Table` of all columns of numbers in the given lines of text, which stand for the lines of the file `path`."""
    with rewritten(path, lines) as target:
        return read_text(target, all_numbers)

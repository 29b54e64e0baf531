"""Read text files of Stable32: phase in s or fractional frequency, with the interval in a header or comments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from allanite.readers import text
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import read_rewritten

# Source: Stable32 user manual, "Data File Format": lines "File:", "Date:", "Type: Phase", "Tau: 1.0e+00", each with or
# without #, end with "# Header End"; then one value a row, or a time tag in days (MJD) before it.
_TAU = re.compile(r"\btau0?\b\s*[:=]?\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)", re.IGNORECASE)
_TYPE = re.compile(r"^[#\s]*type\s*[:=]\s*(phase|freq)", re.IGNORECASE | re.MULTILINE)
_END = re.compile(r"^[#\s]*header\s+end\b", re.IGNORECASE | re.MULTILINE)


def recognizes(head: bytes) -> bool:
    """True if the first lines contain the end of a Stable32 header."""
    return _END.search(head.decode("latin-1")) is not None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - roles need the names below
    """`Table` of a Stable32 file: phases in s or frequencies, with MJD time tags in d before them if logged.

    A line such as ``# Tau: 1.0`` states the interval in s; otherwise the rate is None. The header, or else the suffix,
    states whether the values are phases or frequencies. A file with names, or with over two columns, is the table of
    `text.read`. If neither header nor suffix decides, names and units are those of `text.read`.
    """
    with path.open(encoding="latin-1") as stream:
        head = stream.read(8192)
    end = _END.search(head)
    if end is None:
        table = text.read(path, text.all_numbers)
    else:
        lines = head[: end.end()].count("\n") + 1
        table = read_rewritten(path, _lines_with_commented_head(path, lines))
    found = _TAU.search("\n".join(line for line in head.splitlines() if not line[:1].isdigit()))
    stated_type = _TYPE.search(head)
    phase = (
        path.suffix.lower() == ".phd" if stated_type is None else stated_type[1].lower() == "phase"
    )
    if len(table.columns) > 2 or table.named:
        return table
    rate = 1.0 / float(found[1]) if found and float(found[1]) > 0 else None
    if stated_type is None and path.suffix.lower() not in (".phd", ".frd"):
        return replace(table, rate=rate)
    names, units = ["phase" if phase else "frequency"], ["s" if phase else "1"]
    if len(table.columns) == 2:
        names, units = ["mjd", *names], ["d", *units]
    return replace(table, names=tuple(names), units=tuple(units), rate=rate, named=True)


def _lines_with_commented_head(path: Path, lines: int) -> Iterator[str]:
    """Yield the lines of a text file without line ends, with ``#`` in front of the first `lines` lines."""
    with path.open(encoding="latin-1") as stream:
        for number, line in enumerate(stream):
            yield f"# {line.rstrip()}" if number < lines else line.rstrip()


FORMAT = LogFormat(
    "Stable32",
    read,
    suffixes=(".phd", ".frd"),
    recognizes=recognizes,
    reads="values at the stated interval; also a text file with `# Header End`",
)

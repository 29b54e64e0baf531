"""Read LabVIEW measurement files (.lvm): a header of keys and values, then names, then rows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.common.unit_kinds import FOREIGN, kind_of_unit
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import read_rewritten, text_lines

# Source: ni.com, "Specification for the LabVIEW Measurement File (.lvm)": a head for the file and one for each segment,
# both ended by ***End_of_Header***; then a line of names, and the rows.
_FIRST = b"LabVIEW Measurement"
_END = "***End_of_Header***"
_NUMBER = re.compile(r"\d+\.?\d*(?:[eE][-+]?\d+)?")
#: Number of first lines in which both headers must end.
HEAD_LINES = 200


def recognizes(head: bytes) -> bool:
    """True if the first line is that of a LabVIEW measurement file."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(_FIRST)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - roles need the names below
    """`Table` of the first segment of a LabVIEW measurement file; the X values are the time if the header says so.

    Without X values, a single ``Delta_X`` states the sampling interval in s. Raises `InputError` for a header in every
    segment.
    """
    separator, comma, keys, names, first = _parsed_header(path)
    if keys.get("Multi_Headings", [""])[0].lower() == "yes":
        raise InputError(
            "a header for every segment (Multi_Headings Yes): save the file with one header only"
        )
    is_time = keys.get("X_Dimension", ["Time"])[0].lower() == "time"

    def rows() -> Iterator[str]:
        """Yield the header as ``#`` comments, then cells separated by tabs, with decimal points."""
        for number, line in enumerate(text_lines(path)):
            if number < first:
                yield f"# {line.strip()}"
                continue
            cells = "\t".join(line.rstrip("\r\n").split(separator)[: len(names)])
            yield cells.replace(",", ".") if comma else cells

    table = read_rewritten(path, rows())
    if len(table.columns) != len(names):
        raise InputError(f"{len(table.columns)} columns, but {len(names)} names")
    labels = iter(keys.get("Y_Unit_Label", []))
    units = ["s" if is_time else None] * len(names)
    for i, name in enumerate(names):
        unit = None if name == "X_Value" else next(labels, None)
        if unit and kind_of_unit(unit) != FOREIGN:
            units[i] = plain(unit)
    shown = ["time" if name == "X_Value" and is_time else name for name in names]
    steps = {float(cell) for cell in keys.get("Delta_X", []) if _NUMBER.fullmatch(cell)} - {0.0}
    if "X_Value" not in names and is_time and len(steps) == 1:
        table = replace(table, rate=1.0 / steps.pop())
    return replace(table, names=tuple(shown), units=tuple(units), named=True)


def _parsed_header(path: Path) -> tuple[str, bool, dict[str, list[str]], list[str], int]:
    """Separator, True for decimal commas, dict from key to values, names, and index of the first row.

    Raises `InputError` if the headers do not end within the first 200 lines, or no names follow. Columns named Comment
    at the end are left out of the names.
    """
    lines = [line.rstrip("\r\n") for line in islice(text_lines(path), HEAD_LINES)]
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)][:2]
    if not ends or ends[-1] + 1 >= len(lines):
        raise InputError(f"no {_END} followed by names and rows")
    header = dict(
        re.split(r"[\t,]", line, maxsplit=1)
        for line in lines[: ends[0]]
        if re.search(r"[\t,]", line)
    )
    separator = "," if header.get("Separator", "").strip().lower().startswith("comma") else "\t"
    comma = separator != "," and header.get("Decimal_Separator", ".").strip() == ","
    cells = [[cell.strip() for cell in line.split(separator)] for line in lines[: ends[-1]]]
    keys = {row[0]: [cell.replace(",", ".") for cell in row[1:] if cell] for row in cells if row}
    names = [cell.strip() for cell in lines[ends[-1] + 1].split(separator)]
    while names and names[-1] in ("Comment", ""):
        names.pop()
    if not names:
        raise InputError(f"no column names after {_END}")
    return separator, comma, keys, names, ends[-1] + 2


FORMAT = LogFormat(
    "LabVIEW measurement file (.lvm)",
    read,
    recognizes=recognizes,
    reads="channels of the first segment with their unit labels; X values as the time",
)

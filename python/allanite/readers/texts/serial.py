"""Read the output of a serial terminal: Arduino's serial monitor with time stamps, or its plotter with labels."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table, split_unit
from allanite.readers.texts import sketch
from allanite.readers.texts._lines import (
    STAMP,
    TERMINAL_NOTE,
    first_lines,
    read_rewritten,
    terminal_times,
    text_lines,
)
from allanite.recording.sensor_names import role_of

# Source: docs.arduino.cc, "Serial Monitor" (IDE 1.8 and 2: "Show timestamp" puts "12:00:00.000 -> " before each line)
# and arduino-serial-plotter-webapp, protocol.md ("label:value" pairs, separated by comma, blank or tab).
_LABEL = r"[A-Za-z_][^\s:,;]*"
# Possessive, and a label only at the start of a word: the time must not grow with the square of a line's length.
_VALUE = r"[-+]?(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?\d++)?|nan|inf|ovf"
_PAIR = re.compile(
    rf"(?<![^\s,;])(?P<label>{_LABEL})\s*[:=]\s*(?P<value>{_VALUE})(?=$|[\s,;])", re.IGNORECASE
)
_SEPARATORS = " \t,;"


def recognizes(head: bytes) -> bool:
    """True if most of the first lines begin with a time stamp of a serial monitor, or consist of labels with values."""
    lines = first_lines(head)
    special = sum(
        STAMP.match(line) is not None or _labels_and_values(line) is not None for line in lines
    )
    return special > 0 and 2 * special > len(lines) and not sketch.recognizes(head)


def _labels_and_values(line: str) -> list[tuple[str, str]] | None:
    """Texts (label, value) of a line that holds nothing else; None for any other line."""
    found = [(m["label"], m["value"]) for m in _PAIR.finditer(line)]
    rest = _PAIR.sub("", line).strip(_SEPARATORS)
    return found if found and not rest else None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - roles need the names below
    """`Table` of the output of a serial monitor or plotter: the values after the time stamps or after their labels.

    Lines of text before the first values are skipped, except a line of column names. The time stamp of the terminal,
    which states when the line arrived, is the time. It is not used if a line lacks it, or if a column is the time.
    Raises `InputError` for text among the values, for a line with other labels than the first, and if the numbers of
    time stamps and rows differ.
    """
    lines = [line.strip() for line in text_lines(path)]
    stamps = [STAMP.match(line) for line in lines]
    bare = [line[m.end() :].strip() if m else line for line, m in zip(lines, stamps, strict=True)]
    labeled = [_labels_and_values(line) for line in bare]
    labels, plain_lines = _without_labels(bare, labeled)
    first = next((i for i, line in enumerate(plain_lines) if _is_row(line)), len(plain_lines))

    # Messages of a starting sketch ("MPU6050 found") become comments. A line with the names of the columns is kept.
    def commented_lines() -> Iterator[str]:
        """Yield the lines of a plain table; text before the first values becomes comments, except the names."""
        for i, line in enumerate(plain_lines):
            is_names = i < first and not labels and _is_header(line, plain_lines[first:])
            yield line if i >= first or is_names or not line else f"# {line}"

    table = read_rewritten(path, commented_lines())
    if labels:
        names, units = zip(*map(split_unit, labels), strict=True)
        table = replace(table, names=names, units=units, named=True)
    stamped = [m for m, line in zip(stamps[first:], plain_lines[first:], strict=True) if line]
    roles = [role_of(*one) for one in zip(table.names, table.units, strict=True)]
    if not stamped or any(m is None for m in stamped) or (table.named and "time" in roles):
        return table
    if len(stamped) != table.n:
        raise InputError(f"{len(stamped)} lines have a time stamp, but {table.n} rows have values")
    time = terminal_times(m["clock"] for m in stamped if m)
    return replace(table, time=time, notes=(*table.notes, TERMINAL_NOTE))


def _without_labels(
    lines: Sequence[str], labeled: Sequence[list[tuple[str, str]] | None]
) -> tuple[list[str], list[str]]:
    """Labels of the values, and every line with its values only, separated by commas.

    Lines before the first labeled one are unchanged. Raises `InputError` for a later line with other labels or none.
    """
    labels: list[str] = []
    values: list[str] = []
    for number, (line, pairs) in enumerate(zip(lines, labeled, strict=True), start=1):
        if pairs is None:
            if labels and line:
                raise InputError(
                    f"row {number} does not consist of labels and values: {plain(line, 60)}"
                )
            values.append(line)
            continue
        own = [label for label, _ in pairs]
        labels = labels or own
        if own != labels:
            raise InputError(
                f"row {number} has the labels {plain(', '.join(own), 80)}, the rows before {plain(', '.join(labels), 80)}"
            )
        values.append(",".join(value for _, value in pairs))
    return labels, values


def _cells(line: str) -> list[str]:
    """List of the non-empty cells of a line, separated by comma, semicolon, tab or blank."""
    return [cell for cell in re.split(r"[\s,;]+", line.strip(_SEPARATORS)) if cell]


def _is_row(line: str) -> bool:
    """True if a line consists of numbers only; False if it is empty."""
    cells = _cells(line)
    return bool(cells) and all(re.fullmatch(_VALUE, cell, re.IGNORECASE) for cell in cells)


def _is_header(line: str, rows: Sequence[str]) -> bool:
    """True if a line has as many cells as the first of `rows` has values.

    Blanks either separate cells or belong to names (``gyro x``): one of the two numbers of cells must agree.
    """
    separated = re.split(r"[\t,;]", line.strip(_SEPARATORS))
    width = len(_cells(rows[0])) if rows else 0
    return width > 0 and width in (len(separated), len(_cells(line)))


FORMAT = LogFormat(
    "Arduino serial monitor (`12:00:00.000 -> 1,2,3`) and plotter (`gx:1 gy:2`)",
    read,
    recognizes=recognizes,
    reads="columns; the time stamp is the time unless the board sends one",
)

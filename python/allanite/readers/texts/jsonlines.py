"""Read JSON lines: one object per line, whose numbers are the columns."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table, split_unit
from allanite.readers.texts._lines import first_lines, numbered_lines
from allanite.recording.sensor_names import role_of

# Source: jsonlines.org: UTF-8, one JSON value a line; a line that is not an object is no row of a log.
#: Maximum fraction of lines that may lack a key. Above, the lines are of different kinds. Chosen by judgment; not measured.
MAX_LACKING = 0.05
_MOMENT = re.compile(r"\d{4}-\d\d-\d\d[T ]")


def recognizes(head: bytes) -> bool:
    """True if the first lines, up to three, are JSON objects, neither empty nor with a key ``schema``."""
    lines = first_lines(head)[:3]
    return bool(lines) and all(_json_object(line) is not None for line in lines)


def _json_object(line: str) -> dict[str, Any] | None:
    """Dict of the JSON object in a line; None if the line is no object, or the object is empty or has a ``schema``."""
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    # An object with a schema is a model file on one line.
    return found if isinstance(found, dict) and found and "schema" not in found else None


def _flat_values(value: object, path: str) -> Iterator[tuple[str, object]]:
    """Yield (keys joined by underscores, value) of all scalars in a JSON value; a list of three has keys x, y and z."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat_values(inner, f"{path}_{key}" if path else str(key))
    elif isinstance(value, list):
        labels = "xyz" if len(value) == 3 else [str(i) for i in range(len(value))]
        for label, inner in zip(labels, value, strict=True):
            yield from _flat_values(inner, f"{path}_{label}")
    else:
        yield path, value


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the numbers in JSON objects, one row per line; numbers in nested objects are named by their path.

    A key that is missing in a line is NaN there; at most 5 % of the lines may lack a key. Columns with text are left
    out; notes name both. A column of date-times named like a time is the time. Raises `InputError` for a line that is
    no object, an infinite number, or no number at all.
    """
    rows: list[dict[str, object]] = []
    numbers: list[int] = []
    for number, line in numbered_lines(path):
        found = _json_object(line)
        if found is None:
            raise InputError(f"row {number} is no JSON object: {plain(line, 60)}")
        rows.append(dict(_flat_values(found, "")))
        numbers.append(number)
    keys = list(dict.fromkeys(key for row in rows for key in row))
    lacking = {key: sum(key not in row for row in rows) for key in keys}
    worst = max(keys, key=lambda key: lacking[key])
    if lacking[worst] > MAX_LACKING * len(rows):
        raise InputError(
            f"the lines hold different kinds of objects: {lacking[worst]} of {len(rows)} lack {plain(worst)};"
            " write the lines of one kind into a file of their own"
        )
    names, units = zip(*(split_unit(key) for key in keys), strict=True)
    columns: dict[int, NDArray[Any]] = {}
    notes = [f"{n} lines lack {plain(key)}: missing samples" for key, n in lacking.items() if n]
    time = None
    for at, key in enumerate(keys):
        values = [row.get(key) for row in rows]
        is_time = time is None and role_of(names[at], units[at]) == "time"
        if is_time and all(isinstance(v, str) and _MOMENT.match(v) for v in values):
            time = np.array(values, dtype=object)
        found_numbers = [_json_number(v) for v in values]
        if any(
            n is None and isinstance(v, str) for n, v in zip(found_numbers, values, strict=True)
        ):
            continue
        columns[at] = np.array(found_numbers, dtype=np.float64)
        infinite = np.flatnonzero(np.isinf(columns[at]))
        if infinite.size:
            where = f"row {numbers[infinite[0]]}, {plain(key)}"
            raise InputError(f"{where}: the number is infinite; write null for a missing sample")
    texts = [plain(key) for at, key in enumerate(keys) if at not in columns]
    if texts:
        notes.append(f"text, not read: {', '.join(texts)}")
    if not columns:
        raise InputError("no number in these JSON lines")
    shown = [(names[at], values, units[at]) for at, values in columns.items()]
    return Table.of(shown, time=time, notes=tuple(notes))


def _json_number(value: object) -> float | None:
    """Number of a JSON value, also in a text: NaN for null, 1 or 0 for a Boolean, None for anything else."""
    if value is None:
        return float("nan")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None


FORMAT = LogFormat(
    "JSON lines",
    read,
    recognizes=recognizes,
    reads="numbers of the objects, named by their path",
)

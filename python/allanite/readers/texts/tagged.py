"""Read logs with rows of several sensors that each begin with the name of the sensor: ``ACCE;…``, ``GYRO;…``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import first_lines, read_rewritten, text_lines

#: A row that begins with a word, followed by numbers. Comments begin with %, # or /.
_ROW = re.compile(r"^\"?(?P<tag>[A-Za-z][A-Za-z_]{1,23}\d?)\"?[;,\t]\s*-?[\d.]")
_SEPARATOR = r"[;,\t]"
# The first cell of a row with its separator.
_CELL = re.compile(rf"^[^;,\t]*{_SEPARATOR}")
#: Minimum number of rows, and of changes of the word between rows, with which the format is recognized. Chosen by
#: judgment; not measured.
MIN_ROWS, MIN_CHANGES = 8, 4
#: Maximum number of different words. More words are labels of rows. Chosen by judgment; not measured.
MAX_TAGS = 12
#: Names of gyroscopes and accelerometers, in the order in which one is read by default.
_KINDS = (re.compile("gyr", re.IGNORECASE), re.compile("acc", re.IGNORECASE))


def recognizes(head: bytes) -> bool:
    """True if at least 8 rows, and 80 %, begin with one of 2 to 12 words, one of which names an inertial sensor.

    The word must change at least 4 times between rows.
    """
    lines = [line for line in first_lines(head) if line[0] not in "%#/"]
    rows = [m["tag"] for line in lines if (m := _ROW.match(line))]
    if len(rows) < max(MIN_ROWS, 0.8 * len(lines)):
        return False
    changes = sum(a != b for a, b in pairwise(rows))
    return (
        changes >= MIN_CHANGES
        and 2 <= len(set(rows)) <= MAX_TAGS
        and any(kind.search(tag) for tag in set(rows) for kind in _KINDS)
    )


def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - roles need all
    """`Table` of a log whose rows begin with a sensor's name: rows of the topic, or else the gyroscope or accelerometer.

    Only names of at least 4 rows are sensors. If both exist, the table has the gyroscope and its attribute `others` the
    name of the accelerometer. A note names the other rows. Raises `InputError` for several topics, and if no row
    belongs to the topic.
    """
    tags: Counter[str] = Counter()
    last, header = "", None
    for number, line in enumerate(text_lines(path)):
        match = _ROW.match(line)
        if match is not None:
            if not tags and len(re.split(_SEPARATOR, last)) == len(re.split(_SEPARATOR, line)):
                header = number - 1
            tags[match["tag"]] += 1
        last = line
    found = [tag for tag in tags if tags[tag] >= MIN_ROWS // 2]
    sensors = [next((tag for tag in found if kind.search(tag)), None) for kind in _KINDS]
    chosen = [tag for tag in sensors if tag is not None]
    if topics:
        if len(topics) > 1 or topics[0] not in tags:
            raise InputError(
                f"no rows of {plain(', '.join(topics), 60)}, only of {plain(', '.join(found), 120)}",
                missing="topic",
                remedy="; choose one with {topic}",
            )
        chosen = [topics[0]]
    own, *other_tags = chosen

    def rows() -> Iterator[str]:
        """Yield the lines of a plain table: rows of the chosen sensor without its name, other lines as comments."""
        for number, line in enumerate(text_lines(path)):
            match = _ROW.match(line)
            # Other rows become comments, so that row numbers in errors are right.
            is_own = number == header or (match is not None and match["tag"] == own)
            yield _CELL.sub("", line.rstrip()) if is_own else f"# {line.rstrip()}"

    table = read_rewritten(path, rows())
    others = [tag for tag in found if tag not in (own, *other_tags)]
    note = f"rows of {own}" + (
        f"; not read: rows of {plain(', '.join(others), 80)}" if others else ""
    )
    return replace(table, notes=(*table.notes, note), others=tuple(other_tags))


FORMAT = LogFormat(
    "rows of several sensors in turn (`ACCE;…`, `GYRO;…`)",
    read,
    recognizes=recognizes,
    has_topics=True,
    reads="one sensor as the topic; `characterize` reads gyroscope and accelerometer",
)

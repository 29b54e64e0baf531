"""Letter of the axis in the name of a column."""

from __future__ import annotations

import re
from collections.abc import Sequence

#: x, y or z by itself or at the end of a name: gyro_x, gyro.x.raw, gx.
AXIS = re.compile(r"(?<![a-z])[xyz](?![a-z])|[xyz]$", re.IGNORECASE)


def axis_letter(name: str) -> str | None:
    """``"x"``, ``"y"`` or ``"z"``, the first letter of an axis in a column's name (gyro_x, gx); None without one."""
    found = AXIS.search(name)
    return None if found is None else found.group().lower()


def axis_triples(names: Sequence[str]) -> list[tuple[int, ...]]:
    """List of triples of ascending indices into `names`: three names that differ only in the letter x, y or z of the axis.

    Columns z, y, x also give (0, 1, 2). Of equal names, the first counts. Without such a triple, three names of any
    kind give [(0, 1, 2)], and other numbers of names an empty list.
    """
    stems: dict[str, dict[str, int]] = {}
    for place, name in enumerate(names):
        letter = axis_letter(name)
        if letter is not None:
            stems.setdefault(AXIS.sub("", name), {}).setdefault(letter, place)
    found = [tuple(places.values()) for places in stems.values() if len(places) == 3]
    return found or ([tuple(range(3))] if len(names) == 3 else [])

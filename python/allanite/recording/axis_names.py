"""Letter of the axis in the name of a column."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: x, y or z by itself or at the end of a name: gyro_x, gyro.x.raw, gx.
AXIS = re.compile(r"(?<![a-z])[xyz](?![a-z])|[xyz]$", re.IGNORECASE)


def letter_of(name: str) -> str | None:
    """``"x"``, ``"y"`` or ``"z"`` if the name of a column contains the letter of an axis, else None."""
    found = AXIS.search(name)
    return None if found is None else found.group().lower()


def triples(names: Sequence[str]) -> list[tuple[int, ...]]:
    """List of index triples of names that differ only in the letter of the axis.

    Without such names, three names of any kind are one triple.
    """
    stems: dict[str, dict[str, int]] = {}
    for place, name in enumerate(names):
        letter = letter_of(name)
        if letter is not None:
            stems.setdefault(AXIS.sub("", name), {}).setdefault(letter, place)
    found = [tuple(places.values()) for places in stems.values() if len(places) == 3]
    return found or ([tuple(range(3))] if len(names) == 3 else [])

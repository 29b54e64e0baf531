"""Which columns belong together: the axes of one sensor."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY
from allanite.readers import kind_of_sensor

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.recording import Recording

__all__ = ["NAMES", "letter_of", "triads"]

NAMES = {ANGULAR_RATE: "gyroscope", ACCELERATION: "accelerometer", FREQUENCY: "clock"}
#: x, y or z by itself or at the end of a name: gyro_x, gyro.x.raw, gx.
_AXIS = re.compile(r"(?<![a-z])[xyz](?![a-z])|[xyz]$", re.IGNORECASE)


def letter_of(name: str) -> str | None:
    """``"x"``, ``"y"`` or ``"z"`` where the name of a column says of which axis it is."""
    found = _AXIS.search(name)
    return None if found is None else found.group().lower()


def triads(columns: Iterable[Recording]) -> list[tuple[str, ...]]:
    """Names of the columns of each sensor, in their order.

    Columns of one kind of unit whose names differ in the letter of the axis are one sensor; where no name has a letter,
    all of a kind are.
    """
    kinds: dict[str, dict[str, list[str]]] = {}
    for column in columns:
        name = column.columns[0]
        stems = kinds.setdefault(kind_of_sensor(name, column.unit), {})
        stems.setdefault(_AXIS.sub("", name), []).append(name)
    groups: list[tuple[str, ...]] = []
    for stems in kinds.values():
        if all(len(names) == 1 for names in stems.values()):
            groups.append(tuple(name for names in stems.values() for name in names))
        else:
            groups += [tuple(names) for names in stems.values()]
    return groups

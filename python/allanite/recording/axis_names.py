"""Axes and sensors of columns, by the letter of the axis in their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from allanite.recording.sensor_names import kind_of_sensor

if TYPE_CHECKING:
    from allanite.recording.record import Record

#: x, y or z by itself or at the end of a name: gyro_x, gyro.x.raw, gx.
AXIS = re.compile(r"(?<![a-z])[xyz](?![a-z])|[xyz]$", re.IGNORECASE)


def axis_letter(name: str) -> str | None:
    """``"x"``, ``"y"`` or ``"z"``, the first letter of an axis in a column's name (gyro_x, gx); None without one."""
    found = AXIS.search(name)
    return None if found is None else found.group().lower()


def axis_triples(names: Sequence[str]) -> list[tuple[int, ...]]:
    """Triples of ascending indices of names that differ only in the letter x, y or z; of equal names, the first counts.

    Without such a triple, three names of any kind give [(0, 1, 2)], and other numbers of names an empty list.
    """
    stems: dict[str, dict[str, int]] = {}
    for place, name in enumerate(names):
        letter = axis_letter(name)
        if letter is not None:
            stems.setdefault(AXIS.sub("", name), {}).setdefault(letter, place)
    found = [tuple(places.values()) for places in stems.values() if len(places) == 3]
    return found or ([tuple(range(3))] if len(names) == 3 else [])


def columns_by_sensor(columns: Iterable[Record]) -> list[tuple[str, ...]]:
    """Column names of each sensor, such as ``("gyro_x", "gyro_y", "gyro_z")``, in their given order.

    Columns are one sensor if they measure one quantity and their names differ only in the letter of the axis. If no two
    columns of a quantity have such names, all columns of this quantity are one sensor.
    """
    kinds: dict[str, dict[str, list[str]]] = {}
    for column in columns:
        name = column.columns[0]
        stems = kinds.setdefault(kind_of_sensor(name, column.unit), {})
        stems.setdefault(AXIS.sub("", name), []).append(name)
    groups: list[tuple[str, ...]] = []
    for stems in kinds.values():
        if all(len(names) == 1 for names in stems.values()):
            groups.append(tuple(name for names in stems.values() for name in names))
        else:
            groups += [tuple(names) for names in stems.values()]
    return groups

"""Grouping of columns into sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, MAGNETIC_FIELD
from allanite.readers import kind_of_sensor
from allanite.recording.axis_names import AXIS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.recording.record import Record

#: Kind of sensor → name of the sensor.
NAMES = {
    ANGULAR_RATE: "gyroscope",
    ACCELERATION: "accelerometer",
    FREQUENCY: "clock",
    MAGNETIC_FIELD: "magnetometer",
}


def columns_by_sensor(columns: Iterable[Record]) -> list[tuple[str, ...]]:
    """List of tuples: names of the columns of each sensor, in the order of the columns.

    Columns of one kind of unit whose names differ only in the letter of the axis are one sensor. If no two names of a kind
    differ only in this letter, all columns of this kind are one sensor.
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

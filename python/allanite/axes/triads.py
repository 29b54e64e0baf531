"""Grouping of columns into sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, MAGNETIC_FIELD
from allanite.recording.axis_names import AXIS
from allanite.recording.sensor_names import kind_of_sensor

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
    """List of tuples: the column names of each sensor, such as ``("gyro_x", "gyro_y", "gyro_z")``, in their given order.

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

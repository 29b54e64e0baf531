"""PX4's ULog, by pyulog: one sensor topic becomes one log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._table import Table

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker

__all__ = ["read"]

# Topics with inertial samples, best first: raw FIFO-decimated samples before combined ones.
TOPICS = ("sensor_combined", "sensor_gyro", "sensor_accel", "sensor_gyro_fifo", "vehicle_imu")
FIELDS = {
    "gyro_rad": ("gyro", "rad/s"),
    "accelerometer_m_s2": ("acc", "m/s^2"),
}


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read ``sensor_combined``, or else ``sensor_gyro`` or ``sensor_accel``, first instance.

    Raises
    ------
    InputError
        A damaged file, or no inertial topic in it; the topics are listed.
    """
    from pyulog import ULog

    try:
        # Opened here, because pyulog leaves a damaged file open.
        with path.open("rb") as stream:
            log = ULog(stream)
    except Exception as error:  # pyulog raises whatever the bytes lead it to
        raise InputError(f"damaged or not a ULog file ({error})") from None
    topics = {data.name: data for data in reversed(log.data_list)}
    name = next((topic for topic in TOPICS if topic in topics), None)
    if name is None:
        raise InputError(f"no inertial topic among {', '.join(sorted(topics)) or 'none at all'}")
    data = topics[name].data
    columns: dict[str, Any] = {}
    units: list[str | None] = []
    for field, values in data.items():
        column, unit = _column(name, field)
        if column is not None:
            columns[column] = values
            units.append(unit)
    key = (
        "timestamp_sample"
        if "timestamp_sample" in data and np.any(data["timestamp_sample"])
        else "timestamp"
    )
    return Table(
        tuple(columns),
        tuple(columns.values()),
        tuple(units),
        # Microseconds since boot; as nanoseconds their magnitude cannot be mistaken.
        time=data[key].astype(np.int64).astype("datetime64[us]"),
    )


def _column(topic: str, field: str) -> tuple[str | None, str | None]:
    """Column name and unit of a field, or None for a field that is no sample."""
    base, _, index = field.partition("[")
    axis = {"0]": "x", "1]": "y", "2]": "z"}.get(index)
    if base in FIELDS and axis:
        sensor, unit = FIELDS[base]
        return f"{sensor}_{axis}", unit
    if field in ("x", "y", "z"):
        sensor, unit = ("gyro", "rad/s") if "gyro" in topic else ("acc", "m/s^2")
        return f"{sensor}_{field}", unit
    return ("temperature", "degC") if field == "temperature" else (None, None)

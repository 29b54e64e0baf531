"""Read PX4 ULog files with pyulog: one sensor topic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated, refused_as
from allanite.readers._table import Picker, Table
from allanite.readers.topics._quiet import quiet

# Topics with inertial samples, in order of preference.
TOPICS = ("sensor_combined", "sensor_gyro", "sensor_accel", "sensor_gyro_fifo", "vehicle_imu")
# Array field → prefix of its columns, and unit (PX4 message definitions).
FIELDS = {
    "gyro_rad": ("gyro", "rad/s"),
    "accelerometer_m_s2": ("acc", "m/s^2"),
}


@isolated("pyulog", 0.1, ["pyulog.core"])
def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a ULog: the given topic, or ``sensor_combined``, or else ``sensor_gyro``, ``sensor_accel``, ….

    ``sensor_gyro.1`` is the second instance. A topic without a temperature gets that of ``sensor_gyro``,
    ``sensor_accel`` or ``sensor_baro``, interpolated. For ``sensor_gyro``, the attribute `others` of the table names
    the accelerometer. Raises `InputError` for several topics, and without such a topic.
    """
    from pyulog import core

    # Opened here, because pyulog leaves a damaged file open.
    with refused_as("a ULog file"), path.open("rb") as stream, quiet(core):
        log = core.ULog(stream)
    found = {f"{data.name}.{data.multi_id}": data.data for data in log.data_list}
    shown = ", ".join(sorted(name.removesuffix(".0") for name in found)) or "no topics"
    if len(topics) > 1:
        raise InputError("topics of a ULog have different rates: give only one topic")
    wanted = [f"{t}.0" if not t[-1:].isdigit() or "." not in t else t for t in topics]
    name = next((topic for topic in wanted or [f"{t}.0" for t in TOPICS] if topic in found), None)
    if name is None:
        what = f"no topic {topics[0]}" if topics else "no inertial topic"
        raise InputError(f"{what} among {shown}")
    data = found[name]
    columns: dict[str, tuple[Any, str | None]] = {}
    for field, values in data.items():
        column, unit = _column_and_unit(name, field)
        if column is None and topics and not field.startswith("timestamp"):
            column = field  # every field of another topic is a column
        if column is not None:
            columns[column] = values, unit
    time = _sample_times(data)
    if "temperature" not in columns:
        for other in ("sensor_gyro.0", "sensor_accel.0", "sensor_baro.0"):
            if "temperature" in found.get(other, {}) and other != name:
                theirs = found[other]
                values = np.interp(time, _sample_times(theirs), theirs["temperature"])
                columns["temperature"] = values, "degC"
                break
    others = [t.removesuffix(".0") for t in found if t.split(".")[0] in TOPICS and t != name]
    # Without a combined topic, gyroscope and accelerometer are separate topics.
    apart = [] if topics or name != "sensor_gyro.0" else [t for t in others if t == "sensor_accel"]
    others = [t for t in others if t not in apart]
    note = f"topics not read: {', '.join(sorted(others))} (name one as the topic)"
    return Table.of(
        [(column, values, unit) for column, (values, unit) in columns.items()],
        # Microseconds since boot, as date-times, so that their unit is unambiguous.
        time=time.astype("datetime64[us]"),
        notes=(note,) * bool(others),
        others=tuple(apart),
    )


def _sample_times(data: dict[str, Any]) -> NDArray[np.int64]:
    """Array of the times of the samples in µs, shape (n,); times of the messages if the log has no others."""
    sampled = "timestamp_sample" in data and np.any(data["timestamp_sample"])
    return data["timestamp_sample" if sampled else "timestamp"].astype(np.int64)


def _column_and_unit(topic: str, field: str) -> tuple[str | None, str | None]:
    """Column name and unit of a field, such as ``("gyro_x", "rad/s")``; (None, None) if it is no sample."""
    base, _, index = field.partition("[")
    axis = {"0]": "x", "1]": "y", "2]": "z"}.get(index)
    if base in FIELDS and axis:
        sensor, unit = FIELDS[base]
        return f"{sensor}_{axis}", unit
    if field in ("x", "y", "z"):
        sensor, unit = ("gyro", "rad/s") if "gyro" in topic else ("acc", "m/s^2")
        return f"{sensor}_{field}", unit
    return ("temperature", "degC") if field == "temperature" else (None, None)


FORMAT = LogFormat(
    "PX4 ULog",
    read,
    suffixes=(".ulg",),
    magic=((b"ULog", ".ulg"),),
    has_topics=True,
    reads="one sensor topic",
)

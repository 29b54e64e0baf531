"""Read CSV of ``rostopic echo -p`` (ROS 1): one message per row, fields named by their path."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from allanite.readers import text
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import text_lines

# Source: wiki.ros.org/rostopic, "echo -p": the first line names the fields ("%time,field.header.seq,…"); %time is when
# the message was received, field.header.stamp when the sensor was read, both in ns.
_HEADER = re.compile(rb"^(?:\xef\xbb\xbf)?%time,field")
_RECEIVED, _STAMP = "time", "field.header.stamp"
# Units of sensor_msgs/Imu and sensor_msgs/Temperature (REP 103).
_UNITS = {"angular_velocity": "rad/s", "linear_acceleration": "m/s^2", "temperature": "degC"}
# Name of a vector in the message → name of the sensor in columns.
_NAMES = {"angular_velocity": "gyro", "linear_acceleration": "acc"}
# A component of a vector: path, name of the vector, axis.
_VECTOR = re.compile(r"^(.*?)([^.]+)\.([xyz])$")


def recognizes(head: bytes) -> bool:
    """True if the first line names the fields of a message, as `rostopic echo -p` prints them."""
    return _HEADER.match(head) is not None


def _name_and_unit(field: str) -> tuple[str, str | None]:
    """Column name and unit, or None, of a field of a message: ``field.angular_velocity.x`` is ``gyro_x`` in rad/s."""
    path = field.removeprefix("field.")
    vector = _VECTOR.match(path)
    if vector is None:
        return path, _UNITS.get(path)
    name = _NAMES.get(vector[2], vector[2])
    return f"{vector[1]}{name}_{vector[3]}", _UNITS.get(vector[2])


def _becomes_column(field: str) -> bool:
    """True unless a field of a message belongs to a header, covariance or orientation, or is a sequence number.

    The time of receipt and the stamp of the header become columns, too.
    """
    if field in (_RECEIVED, _STAMP):
        return True
    return not re.search(r"\.header\.|_?covariance|orientation|frame_id|\.seq$", field)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - the format says which fields are samples
    """`Table` of the output of `rostopic echo -p`: the fields that can be samples, with the stamp in each header as time.

    If one of the stamps is missing (0), all times are those of receipt. A note says which time is used.
    """
    fields = next(text_lines(path)).strip().lstrip("%").split(",")
    kept = [i for i, field in enumerate(fields) if _becomes_column(field)]
    table = text.read(path, lambda _: kept)
    times = {name: table[i] for i, name in enumerate(table.names) if name in (_RECEIVED, _STAMP)}
    stamps = times.get(_STAMP)
    stamped = stamps is not None and bool(np.all(stamps > 0))
    time = stamps if stamped and stamps is not None else times[_RECEIVED]
    left = [i for i in range(len(table.names)) if table.names[i] not in (_RECEIVED, _STAMP)]
    left = [i for i in left if _becomes_column(table.names[i])]
    shown, units = zip(*(_name_and_unit(table.names[i]) for i in left), strict=True)
    note = (
        "the time is the stamp in each header"
        if stamped
        else "the headers have no stamps; the time is that of receipt (%time)"
    )
    return replace(
        table,
        names=shown,
        columns=tuple(table.columns[i] for i in left),
        units=units,
        texts={},
        dates=frozenset(),
        time=np.rint(time).astype(np.int64).astype("datetime64[ns]"),
        notes=(*table.notes, note),
    )


FORMAT = LogFormat(
    "`rostopic echo -p`",
    read,
    recognizes=recognizes,
    reads="gyroscope and accelerometer at the stamps of the headers",
)

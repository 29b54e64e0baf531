"""ROS 1 and ROS 2 bags and MCAP, by rosbags: the sensor_msgs/Imu messages of one topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._table import Table, columns_of

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker

__all__ = ["read"]

NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
UNITS = ("rad/s",) * 3 + ("m/s^2",) * 3  # REP 103


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read the first topic of type ``sensor_msgs/msg/Imu``, stamped by its headers.

    Raises
    ------
    InputError
        A damaged bag, or no Imu topic in it; the topics are listed.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    folder = (
        path.parent if path.suffix in (".db3", ".mcap") and _has_metadata(path.parent) else path
    )
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.LATEST)) as bag:
            return _imu(bag)
    except InputError:
        raise
    except Exception as error:  # rosbags raises whatever the bytes lead it to
        raise InputError(f"damaged or not a ROS bag ({error})") from None


def _has_metadata(folder: Path) -> bool:
    return (folder / "metadata.yaml").exists()


def _imu(bag) -> Table:  # type: ignore[no-untyped-def]  # noqa: ANN001
    found = [c for c in bag.connections if c.msgtype == "sensor_msgs/msg/Imu"]
    if not found:
        topics = ", ".join(sorted(f"{c.topic} ({c.msgtype})" for c in bag.connections)) or "none"
        raise InputError(f"no sensor_msgs/Imu topic in the bag; its topics: {topics}")
    topic = found[0].topic
    rows: list[tuple[float, ...]] = []
    stamps: list[int] = []
    for connection, received, raw in bag.messages([c for c in found if c.topic == topic]):
        message = bag.deserialize(raw, connection.msgtype)
        rate, force = message.angular_velocity, message.linear_acceleration
        rows.append((rate.x, rate.y, rate.z, force.x, force.y, force.z))
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        # Some drivers leave the header empty; the time of receipt is the next best.
        stamps.append(stamp or received)
    if not rows:
        raise InputError(f"topic {topic} holds no message")
    time = np.array(stamps, dtype=np.int64).astype("datetime64[ns]")
    return Table(NAMES, columns_of(np.array(rows)), UNITS, time=time)

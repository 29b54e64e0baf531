"""Read ROS 1 and ROS 2 bags and MCAP with rosbags: the messages of one topic, and a temperature."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated, refused_as
from allanite.readers._table import Picker, Table

#: Types of messages.
IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"
#: Column → field, axis and unit of sensor_msgs/Imu (units as in REP 103).
AXES = {
    f"{sensor}_{axis}": (field, axis, unit)
    for sensor, field, unit in (
        ("gyro", "angular_velocity", "rad/s"),
        ("acc", "linear_acceleration", "m/s^2"),
    )
    for axis in "xyz"
}


@isolated("rosbags", 0.07, ["rosbags.highlevel", "rosbags.typesys"])
def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a ROS bag: the given topics, or the first topic of type ``sensor_msgs/msg/Imu``.

    Without given topics, the accelerometer or gyroscope of a second IMU topic is added if it has the same rate. Stamps
    in headers are the time, or else the times of receipt. Raises `InputError` if a topic is missing, or if topics have
    different rates.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    in_bag = path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").exists()
    folder = path.parent if in_bag else path
    if folder.is_dir() and not all(file.is_file() or file.is_dir() for file in folder.iterdir()):
        raise InputError("the folder of the bag contains a pipe or a device: remove it")
    with (
        refused_as("a ROS bag"),
        AnyReader([folder], default_typestore=get_typestore(Stores.LATEST)) as bag,
    ):
        return _table_of_topics(bag, topics)


def _table_of_topics(bag: Any, requested: Sequence[str]) -> Table:
    """`Table` of the `requested` topics of an open bag, or else of its first IMU topic.

    Without requested topics, an IMU topic with only the other kind of sensor is joined, or, at another rate, named in
    `others`. Temperatures are interpolated to the times of the first topic. Raises `InputError` if a topic is missing,
    there is no IMU, or the requested topics have different rates.
    """
    types = {c.topic: c.msgtype for c in bag.connections}
    listed = ", ".join(sorted(f"{topic} ({kind})" for topic, kind in types.items())) or "none"
    imus = [topic for topic, kind in types.items() if kind == IMU]
    unknown = [topic for topic in requested if topic not in types]
    if unknown:
        raise InputError(f"no topic {unknown[0]} in the bag; its topics: {listed}")
    if not requested and not imus:
        raise InputError(f"no sensor_msgs/Imu topic in the bag; its topics: {listed}")
    thermal = [topic for topic, kind in types.items() if kind == TEMPERATURE]
    main = [topic for topic in (requested or imus[:1]) if topic not in thermal]
    if not main:
        main, thermal = list(requested), []
    columns: list[tuple[str, NDArray[Any], str | None]] = []
    time: NDArray[np.int64] | None = None
    for topic in main:
        stamps, found = _messages_of_topic(bag, topic, types[topic])
        time = stamps if time is None else time
        if not _is_same_rate(stamps, time):
            raise InputError(
                f"topics {main[0]} ({time.size} messages) and {topic} ({stamps.size}) have"
                " different rates: read one topic at a time"
            )
        prefix = f"{topic.strip('/').replace('/', '.')}." if len(main) > 1 else ""
        columns += _at_times(found, stamps, time, prefix)
    assert time is not None
    joined, apart = (None, None) if requested else _join_other_imu(bag, imus[1:], columns, time)
    for topic in thermal if not requested else [t for t in requested if t in thermal]:
        stamps, found = _messages_of_topic(bag, topic, TEMPERATURE)
        if "temperature" in found:
            name = "temperature" if len(thermal) == 1 else f"temperature_{len(columns)}"
            values = np.interp(time - time[0], stamps - time[0], found["temperature"][0])
            columns.append((name, values, "degC"))
    others = tuple(
        f"topic {topic} is not read (name it as the topic)"
        for topic in imus
        if topic not in (*main, joined, apart)
    )
    return Table.of(
        columns,
        time=time.astype("datetime64[ns]"),
        notes=others,
        others=() if apart is None else (apart,),
    )


def _join_other_imu(
    bag: Any,
    topics: Sequence[str],
    columns: list[tuple[str, NDArray[Any], str | None]],
    time: NDArray[np.int64],
) -> tuple[str | None, str | None]:
    """Append the sensor that `columns` lack, gyroscope or accelerometer, from the first of the IMU `topics` with it alone.

    Returns (joined, apart): the topic whose columns were appended, and the one with another rate; each may be None.
    """
    present = _sensor_prefixes(name for name, _, _ in columns)
    # RealSense and others publish the accelerometer on a separate topic, usually with another rate.
    for topic in topics if len(present) < 2 else ():
        try:
            stamps, found = _messages_of_topic(bag, topic, IMU)
        except InputError:  # an empty topic
            continue
        sensors = _sensor_prefixes(found)
        # A topic with both sensors is another device.
        if not sensors or sensors & present:
            continue
        if not _is_same_rate(stamps, time):
            return None, topic
        columns += _at_times(found, stamps, time)
        return topic, None
    return None, None


def _at_times(
    found: Mapping[str, tuple[NDArray[Any], str | None]],
    stamps: NDArray[np.int64],
    time: NDArray[np.int64],
    prefix: str = "",
) -> list[tuple[str, NDArray[Any], str | None]]:
    """Tuples (name, values, unit or None) of a topic, with values of the message nearest to each time (ns)."""
    nearest = np.searchsorted((stamps[1:] + stamps[:-1]) // 2, time)
    return [
        (prefix + name, values if stamps is time else values[nearest], unit)
        for name, (values, unit) in found.items()
    ]


def _sensor_prefixes(names: Iterable[str]) -> set[str]:
    """Set of the sensors, ``gyro`` and ``acc``, that the column names begin with; empty for other names."""
    return {name.partition("_")[0] for name in names} & {"gyro", "acc"}


def _is_same_rate(one: NDArray[np.int64], other: NDArray[np.int64]) -> bool:
    """True if the numbers of messages of two topics differ by at most one plus 0.1 %; the stamps are not compared."""
    return abs(one.size - other.size) <= 0.001 * other.size + 1


def _messages_of_topic(
    bag: Any, topic: str, kind: str
) -> tuple[NDArray[np.int64], dict[str, tuple[NDArray[Any], str | None]]]:
    """Time stamps of a topic in ns, and a dict from column name to (values, unit or None).

    A stamp of 0 is replaced by the time of receipt. Of an IMU, a sensor with only zeros is left out. Raises
    `InputError` if the topic holds no message or no number.
    """
    rows: list[tuple[float, ...]] = []
    stamps: list[int] = []
    names: tuple[str, ...] = tuple(AXES)
    for connection, received, raw in bag.messages([c for c in bag.connections if c.topic == topic]):
        message = bag.deserialize(raw, connection.msgtype)
        stamp = 0
        with contextlib.suppress(AttributeError):
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        # Some drivers leave the header empty. Then the time of receipt is used.
        stamps.append(stamp or received)
        if kind == IMU:
            rows.append(
                tuple(getattr(getattr(message, field), axis) for field, axis, _ in AXES.values())
            )
        else:
            flat = dict(_numbers_in_message(message, ""))
            names = tuple(flat)
            rows.append(tuple(flat.values()))
    if not rows or not rows[0]:
        raise InputError(f"topic {topic} holds no {'message' if not rows else 'number'}")
    data = np.array(rows, dtype=np.float64)
    units = [unit for *_, unit in AXES.values()] if kind == IMU else [None] * len(names)
    found = {
        name: (data[:, i], unit)
        for i, (name, unit) in enumerate(zip(names, units, strict=True))
        # A topic with only one of gyroscope and accelerometer has zeros in the fields of the other.
        if kind != IMU or data[:, i - i % 3 : i - i % 3 + 3].any()
    }
    return np.array(stamps, dtype=np.int64), found


def _numbers_in_message(message: Any, prefix: str) -> Iterator[tuple[str, float]]:
    """Yield (field names joined by underscores, value) of every number in a message outside of headers and arrays.

    Booleans, and constants (names that begin with ``__``), are left out, too.
    """
    for field in fields(message):
        value = getattr(message, field.name)
        if field.name == "header" or field.name.startswith("__"):
            continue
        if is_dataclass(value):
            yield from _numbers_in_message(value, f"{prefix}{field.name}_")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{prefix}{field.name}", float(value)


def log_in(folder: Path) -> Path | None:
    """The folder itself if it is a ROS 2 bag, else None."""
    return folder if (folder / "metadata.yaml").exists() else None


FORMAT = LogFormat(
    "ROS bag and MCAP",
    read,
    suffixes=(".bag", ".db3", ".mcap"),
    log_in=log_in,
    magic=((b"#ROSBAG", ".bag"),),
    has_topics=True,
    reads="one topic of IMU messages, with a temperature",
)

"""Refuse the text that ``rostopic echo`` and ``ros2 topic echo`` print for people, and name formats that can be read."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NoReturn

from allanite.common.errors import InputError
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker

_MESSAGE = re.compile(rb"^(?:\xef\xbb\xbf)?(?:---\s*)?header:\s*\n\s+(?:seq|stamp):", re.MULTILINE)


def recognizes(head: bytes) -> bool:
    """True if the text begins with the header of a ROS message, as `ros2 topic echo` prints it."""
    return _MESSAGE.match(head.replace(b"\r\n", b"\n")) is not None


def read(path: Path, pick: Picker) -> NoReturn:  # noqa: ARG001 - nothing is read
    """Raise `InputError` for the output of `ros2 topic echo`, with the names of formats that hold the same data."""
    raise InputError(
        "messages as rostopic echo prints them, not a table: record a bag (rosbag record, ros2 bag record),"
        " or print rows as CSV (rostopic echo -p, or the CSV option of ros2 topic echo)"
    )


FORMAT = LogFormat(
    "text of `rostopic echo` and `ros2 topic echo`",
    read,
    recognizes=recognizes,
    reads="nothing: refused with a hint at formats that hold the same data",
)

"""Read folders of the EuRoC data set: the table ``data.csv`` of an inertial sensor."""

from __future__ import annotations

from pathlib import Path

from allanite.readers import text
from allanite.readers._format import LogFormat


def log_in(folder: Path) -> Path | None:
    """Path of ``data.csv`` in the folder of a sensor, of ``mav0``, or of a data set (``mav0/imu0/data.csv``); or None."""
    inside = (folder / part / "data.csv" for part in (".", "imu0", "mav0/imu0"))
    return next((file for file in inside if file.is_file()), None)


FORMAT = LogFormat(
    "EuRoC data set",
    text.read,
    log_in=log_in,
    reads="the columns of `data.csv` of one inertial sensor",
)

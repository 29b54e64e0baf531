"""What a column is by its name and unit: its role, and the kind of sensor it speaks of."""

from __future__ import annotations

import re

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, parse_unit

__all__ = ["Role", "kind_of_sensor", "role_of", "sensor_kind"]

Role = str  # "sensor", "time", "temperature", "other"

_TIME = re.compile(
    r"^(t|time|times|timestamps?|time_?stamps?|stamp|sec|secs|seconds|epoch|date_?time|mjd|uptime|"
    r"(seconds|sec|s|time|millis|ms|micros|us|nanos|ns)_?elapsed|elapsed(_?(time|s|sec|seconds|ms|us))?|"
    r"millis|micros|zeit(stempel)?|temps|tiempo|i?tow|gps_?(time|tow)|sampletimefine|timestartup|"
    r"\w*timestamp|"
    r"(sample|unix|utc|system|sensor)_?time(stamp)?(_?(s|sec|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?))?|"
    r"(t|time|timestamp|stamp)_?(s|sec|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?))$"
)
_TEMPERATURE = re.compile(
    r"(^|[^a-z])temp(erature)?s?([^a-z]|$)|^(imu|gyro|acc|die|board)?_?temp(erature)?(_?(deg)?[cfk])?\d*$"
)
_OTHER = re.compile(
    r"(^|[^a-z])(mag|magn|magnet\w*|baro\w*|press\w*|humid\w*|volt\w*|vbat|batt\w*|alt\w*|lat|lon\w*|"
    r"seq|sequence|index|idx|date|packetcounter|counter|count|sample|samples|no|number|status|flags?|roll|pitch|yaw|"
    r"quat\w*|orientation|absolute|valid|q[0-3wxyz]|heading|id)([^a-z]|$)|^(mag|m|b)[xyz]$|^unnamed: \d+$"
)
_GYRO = re.compile(r"gyr|ang.*(vel|rate)|omega|^[gw]_?[xyz]$|^rate_?[xyz]?$|(^|[^a-z])gyr")
_ACCEL = re.compile(r"acc|^a_?[xyz]$|^f_?[xyz]$|spec\w*_?force")


def _key(name: str) -> str:
    """A name as the patterns have it, without the number of one that repeats another."""
    return re.sub(r"\s*\[\d+\]$", "", name).strip().lower().replace(" ", "_")


def role_of(name: str, unit: str | None) -> Role:
    """Tell what a column is, from its unit where it has one, else from its name."""
    key = _key(name).replace("-", "_")
    if _TIME.match(key):
        return "time"
    if _TEMPERATURE.search(key) or (unit or "").replace("°", "deg") in ("degC", "degF", "C", "K"):
        return "temperature"
    if unit is not None and unit.strip() in ("d", "h", "min"):
        return "time"
    if unit is not None:
        # A phase in s, or an angle, is a sensor's too.
        if unit.strip() in ("s", "deg", "°", "rad", "m/s"):
            return "sensor"
        try:
            parse_unit(unit)
        except InputError:
            return "other"
        return "sensor"
    # A nameless column is the index that pandas writes.
    return "other" if not key or _OTHER.search(key) else "sensor"


def sensor_kind(name: str) -> str | None:
    """Kind of sensor that a name speaks of, if it does."""
    key = _key(name)
    if _ACCEL.search(key):
        return ACCELERATION
    return ANGULAR_RATE if _GYRO.search(key) else None


def kind_of_sensor(name: str, unit: str) -> str:
    """Kind of sensor of a column: its unit's; of a dimensionless one its name's: a gyroscope is no clock."""
    kind = parse_unit(unit).kind
    return (sensor_kind(name) or kind) if kind == FREQUENCY else kind

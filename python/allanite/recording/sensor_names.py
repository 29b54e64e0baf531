"""Role of a column by its name and unit, and the kind of sensor that a name states."""

from __future__ import annotations

import re

from allanite.common.unit_kinds import INTEGRAL, PHASE, RATE, TIME_ONLY, kind_of_unit
from allanite.common.units import (
    ACCELERATION,
    ANGULAR_RATE,
    FREQUENCY,
    MAGNETIC_FIELD,
    parse_unit,
    unit_kind,
)

Role = str  # "sensor", "time", "temperature", "other"

#: Names of columns of times, in lower case.
_TIME = re.compile(
    r"^(t|time|times|timestamps?|time_?stamps?|stamp|sec|secs|seconds|epoch|date_?time|m?jd|julian_(day|date)|uptime|"
    r"(seconds|sec|s|time|millis|ms|micros|us|nanos|ns)_?elapsed|elapsed(_?(time|s|sec|seconds|ms|us))?|"
    r"millis|micros|zeit(stempel)?|temps|tiempo|i?_?tow|sow|sod|gps_?(time|tow|seconds)|sampletimefine|timestartup|"
    r"(milli|micro|nano)?(sec|second)s?(_(since|of|from|after)_\w+)?|days?|hours?|minutes?|years?|yr|"
    r"doy|day_?of_?year|(dec(imal)?_?|frac(tional)?_?)?year(_?(dec(imal)?|frac))?|decyear|yyyy\W*y+|yyyy_ddd+|"
    r"\w*timestamp(_since_?\w+)?|time_(since|from|after)_\w+|time_of_(day|week)\w*|"
    r"(sample|unix|utc|system|sensor|host|ros|boot|local|gps|device)_?time(stamp)?(_?(s|sec|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?))?|"
    r"(t|time|timestamp|stamp)_?(in_)?(s|secs?|seconds?|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?|min|h|hours?|d|days?))$"
)
#: Names of temperatures, in lower case.
_TEMPERATURE = re.compile(
    r"(^|[^a-z])temp(erature)?s?([^a-z]|$)|^(imu|gyro|acc|die|board)?_?temp(erature)?(_?(deg)?[cfk])?\d*$"
)
#: Names of other quantities that navigation systems log, in lower case.
_OTHER = re.compile(
    r"(^|[^a-z])(mag|magn|magnet\w*|baro\w*|press\w*|humid\w*|volt\w*|vbat|batt\w*|alt\w*|lat|lon\w*|"
    r"date|week|gps_?week|wn|roll|pitch|yaw|grav\w*|"
    r"quat\w*|orientation|q[0-3wxyz]|heading)([^a-z]|$)|^(mag|m|b)_?[xyz]$|^unnamed: \d+$"
)
#: Names of gyroscopes.
_GYRO = re.compile(
    r"gyr|ang.*(vel|rate)|^pqr|omega|rot\w*_?rate|^[gw]_?[xyz]$|^gy_?[xyz]$|^rate_?[xyz]?$|(^|[^a-z])gyr"
)
#: Names of accelerometers; Kalibr uses alpha.
_ACCEL = re.compile(r"acc(?!uracy)|^ac_?[xyz]$|^a(lpha)?_?[xyz]$|^f_?[xyz]$|spec\w*_?force")
#: Names of columns that are no axis of a sensor, whatever their unit. The patterns search words separated by underscores.
_COVARIANCE = re.compile(
    r"(^|_)(cov(ariances?)?|variances?|sigma|std(dev|ev)?|stderr|accuracy|uncertainty)\d*(_|$)"
)
_STAMP = re.compile(r"(^|_)time_?stamp(_|$)")
#: Reason why a column is no axis of a sensor, and the pattern of its name.
_NOT_AXIS = (
    ("a magnitude", re.compile(r"(^|_)(abs(olute)?|magnitude|norm|total|resultant|modulus|vector_sum|rss)(_|$)")),
    (
        "a counter",
        re.compile(
            r"(^|_)(seq|sequence|index|idx|counts?|counter|packets?|frames?|row|samples?|no|nr|num|number)(_|\d*$)"
        ),
    ),
    (
        "an identifier",
        re.compile(
            r"(^|_)(ids?|serial|serialno|sn|uuid|mac|addr(ess)?)\d*(_|$)|(^|_)(device|dev|node)(_(no|nr|num|number))?$"
        ),
    ),
    (
        "a status",
        re.compile(r"(^|_)(valid|status|flags?|state|mode|health|calibrated|clip(ping|s)?|saturat\w+|overflows?)(_|$)"),
    ),
    (
        "a drive",
        re.compile(r"(^|_)(rpm|motors?|prop(eller)?s?|rotors?|wheels?|servos?|engines?|fans?)\d*(_|$)"),
    ),
    ("another time", _STAMP),
)  # fmt: skip
#: Names of magnetometers. Their unit G (gauss) must not be taken for standard gravity.
_MAGNETIC = re.compile(r"(^|_)(mag|magn|magnet\w*)(_|$)|^(mag|b)_?[xyz]$")
#: The last word of the name of an axis.
_AXIS = re.compile(r"(^|_|[a-z])([xyz]|[0-9])(_|$)")
#: Names of durations, which are no phase of a clock.
_DURATION = re.compile(
    r"(^|_)(dt|delay|latency|rtt|interval|period|duration|exposure|lag|delta_?t(ime)?|jitter)(_|$)"
)
_TEMPERATURE_UNITS = re.compile(
    r"(°|deg(rees?)?)[. _]?([cfk]|celsius|fahrenheit)|(?-i:[CFK])|℃|celsius|fahrenheit|kelvin",
    re.IGNORECASE,
)


def _lower_name(name: str) -> str:
    """Name in lower case with underscores for blanks, without the number (``[2]``) of a repeated name."""
    return re.sub(r"\s+\[\d+\]$", "", name).strip().lower().replace(" ", "_")


def words_in(name: str) -> str:
    """Words of a name in lower case with underscores between them: ``packet_counter`` for ``PacketCounter``."""
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name.strip())
    return re.sub(r"[^a-z0-9µ]+", "_", parted.lower()).strip("_")


def role_of(name: str, unit: str | None) -> Role:
    """Role of a column from its name and unit: ``"sensor"``, ``"time"``, ``"temperature"`` or ``"other"``."""
    return role_and_reason(name, unit)[0]


def role_and_reason(name: str, unit: str | None) -> tuple[Role, str]:
    """Role of a column, and the reason if it is ``"other"``.

    In general the unit decides, and the name decides without a unit. Some names decide against a unit: ``gyro_norm`` and
    ``acc_std`` (no axis of a sensor), magnetometers, durations and time stamps. A column without a unit is a sensor if its
    name fits nothing else; an empty name is ``"other"``.
    """
    key, words = _lower_name(name).replace("-", "_"), words_in(name)
    kind = kind_of_unit(unit)
    if _TEMPERATURE_UNITS.fullmatch((unit or "").strip()):
        return "temperature", ""
    if kind not in (RATE, INTEGRAL) and (_TIME.match(key) or _TIME.match(words)):
        return "time", ""
    if kind in (PHASE, TIME_ONLY) and _STAMP.search(words):
        return "time", ""
    reason = _reason_not_axis(name, words)
    if reason:
        return "other", reason
    if _TEMPERATURE.search(key) or _TEMPERATURE.search(words):
        return "temperature", ""
    if kind == RATE and _is_magnetometer(name, words, unit):
        return "other", "a magnetometer"
    if kind == TIME_ONLY:
        return "time", ""
    if kind == PHASE:
        return ("other", "a duration") if _DURATION.search(words) else ("sensor", "")
    if kind in (RATE, INTEGRAL):
        return "sensor", ""
    if kind is not None:
        return "other", f"{unit} is no unit of a sensor"
    if not key:
        return "other", "an index"  # the nameless column that pandas writes
    if _DURATION.search(words):
        return "other", "a duration"
    if _OTHER.search(key) or _OTHER.search(words):
        return "other", "its name is not that of an inertial sensor"
    return "sensor", ""


def _is_magnetometer(name: str, words: str, unit: str | None) -> bool:
    """True if the name or the unit is that of a magnetometer, and the name is not that of an inertial sensor.

    `words` is `words_in` of the name. Raises `InputError` for an unknown unit, unless the name is that of an inertial
    sensor.
    """
    if sensor_kind(name) is not None:
        return False
    magnetic = unit is not None and parse_unit(unit).kind == MAGNETIC_FIELD
    return magnetic or _MAGNETIC.search(words) is not None


def _reason_not_axis(name: str, words: str) -> str:
    """Reason why a column is no axis of a sensor (``"a covariance"``, ``"a magnitude"``, …); empty if it may be one."""
    if _COVARIANCE.search(words):
        return "a covariance"
    if re.match(r"^\s*[|‖].*[|‖]\s*$", name):
        return "a magnitude"
    # gyro_x_counts are raw counts, device_gyro_x is an axis.
    if sensor_kind(name) is not None and _AXIS.search(words):
        return ""
    return next((reason for reason, pattern in _NOT_AXIS if pattern.search(words)), "")


def sensor_kind(name: str) -> str | None:
    """Kind of sensor that a name states: ``"angular rate"`` (gyroscope) or ``"acceleration"``; None for other names."""
    for key in (_lower_name(name), words_in(name)):
        if _ACCEL.search(key):
            return ACCELERATION
        if _GYRO.search(key):
            return ANGULAR_RATE
    return None


def kind_of_sensor(name: str, unit: str) -> str:
    """Kind of sensor from its unit; if the unit is dimensionless, from its name.

    ``"fractional frequency"`` stands for an unknown unit, and for a dimensionless unit if the name states no sensor.
    """
    kind = unit_kind(unit)
    if kind is None:
        return FREQUENCY
    return (sensor_kind(name) or kind) if kind == FREQUENCY else kind

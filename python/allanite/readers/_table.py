"""What every reader returns: columns of numbers with what the file says about them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.common.units import ACCELERATION, ANGULAR_RATE, parse_unit
from allanite.recording.timebase import TIME_UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Picker", "Role", "Table", "columns_of", "role_of", "sensor_kind", "split_unit"]


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of a log.

    Attributes
    ----------
    names : tuple of str
        One a column, without units.
    columns : tuple of (ndarray of shape (n,) or None)
        The numbers; None where a column was not asked for and not read.
    units : tuple of (str or None)
        Unit of each column as the file says it, if it does.
    rate : float or None
        Sampling rate that the file states, Hz.
    time : ndarray of shape (n,) or None
        Time stamps kept apart from the columns.
    named : bool
        Whether the names come from the file (else they are made up: x0, x1, …).
    notes : tuple of str
        What the reader has to tell.
    """

    names: tuple[str, ...]
    columns: tuple[NDArray[Any] | None, ...]
    units: tuple[str | None, ...]
    rate: float | None = None
    time: NDArray[Any] | None = None
    named: bool = True
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # Names and units are a stranger's text.
        object.__setattr__(self, "names", tuple(map(plain, self.names)))
        object.__setattr__(self, "units", tuple(u and plain(u) for u in self.units))

    def __getitem__(self, at: int) -> NDArray[Any]:
        """Return a column that was asked for."""
        column = self.columns[at]
        if column is None:
            raise IndexError(f"column {self.names[at]} was not read")
        return column

    @property
    def n(self) -> int:
        """Number of rows."""
        return next((len(c) for c in self.columns if c is not None), 0)


def columns_of(data: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Split an array of shape (n,) or (n, k) into its columns, without a copy."""
    return (data,) if data.ndim == 1 else tuple(data[:, i] for i in range(data.shape[1]))


# From names and units of all columns to the indices of those that will be used.
Picker = Callable[[Sequence[str], Sequence[str | None]], Sequence[int]]
Role = str  # "sensor", "time", "temperature", "other"

_WITH_UNIT = re.compile(
    r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*$"
)
_TIME = re.compile(
    r"^(t|time|times|timestamps?|time_?stamps?|stamp|sec|secs|seconds|epoch|date_?time|mjd|uptime|"
    r"(seconds|sec|s|time|millis|ms|micros|us|nanos|ns)_?elapsed|elapsed(_?(time|s|sec|seconds|ms|us))?|"
    r"millis|micros|zeit(stempel)?|temps|tiempo|i?tow|gps_?(time|tow)|sampletimefine|timestartup|"
    r"\\w*timestamp|"
    r"(sample|unix|utc|system|sensor)_?time(stamp)?(_?(s|sec|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?))?|"
    r"(t|time|timestamp|stamp)_?(s|sec|ms|us|ns|usec|msec|nsec|nanos?|micros?|millis?))$"
)
_TEMPERATURE = re.compile(
    r"(^|[^a-z])temp(erature)?s?([^a-z]|$)|^(imu|gyro|acc|die|board)?temp(erature)?\d*$"
)
_OTHER = re.compile(
    r"(^|[^a-z])(mag|magn|magnet\w*|baro\w*|press\w*|humid\w*|volt\w*|vbat|batt\w*|alt\w*|lat|lon\w*|"
    r"seq|sequence|index|idx|date|packetcounter|counter|count|sample|samples|no|number|status|flags?|roll|pitch|yaw|"
    r"quat\w*|q[0-3wxyz]|heading|id)([^a-z]|$)|^(mag|m|b)[xyz]$|^unnamed: \d+$"
)
_GYRO = re.compile(r"gyr|ang.*(vel|rate)|omega|^[gw]_?[xyz]$|^rate_?[xyz]?$|(^|[^a-z])gyr")
_ACCEL = re.compile(r"acc|^a_?[xyz]$|^f_?[xyz]$|spec\w*_?force")


def split_unit(cell: str) -> tuple[str, str | None]:
    """``"gyro x [deg/s]"`` → name and unit; a bracket without a unit stays part of the name."""
    match = _WITH_UNIT.match(cell)
    if match is None or not match["name"]:
        return cell.strip(), None
    return match["name"], match["unit"].strip() or None


def role_of(name: str, unit: str | None) -> Role:
    """Tell what a column is, from its unit where it has one, else from its name."""
    key = name.strip().lower().replace(" ", "_").replace("-", "_")
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


def time_unit_of(name: str, unit: str | None) -> str | None:
    """Return the unit of a time column, if its header says it: ``time [ms]``, ``timestamp_us``."""
    if unit in TIME_UNITS:
        return unit
    if name.strip().lower() == "sampletimefine":  # Xsens: a counter of 10 kHz
        return "100us"
    match = re.search(
        r"_?(ns|nsec|nanos?|us|usec|micros?|ms|msec|millis?|_s|_sec)$", name.strip().lower()
    )
    if match is None:
        return "us" if unit == "µs" else None
    return {"n": "ns", "u": "us", "mic": "us", "ms": "ms", "mil": "ms", "_": "s"}[
        next(k for k in ("n", "u", "mic", "ms", "mil", "_") if match.group(1).startswith(k))
    ]


def sensor_kind(name: str) -> str | None:
    """Kind of sensor that a name speaks of, if it does."""
    key = name.strip().lower().replace(" ", "_")
    if _ACCEL.search(key):
        return ACCELERATION
    return ANGULAR_RATE if _GYRO.search(key) else None

"""Read CSV of MicroStrain's SensorConnect: a preamble of keys and values, channel names with the serial number first."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from allanite.readers import text
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table

# Source: the channel names of MicroStrain's MSCL (MipTypes.cpp, "scaledAccelX", "deltaThetaX", …) and the manuals of the
# 3DM series, which fix their units: scaled acceleration in g, rates in rad/s, ambient pressure in mbar.
_CHANNEL = re.compile(
    rb"(?:^|[,;\t])\"?\d+\.\d+:(?:scaled|delta|est|raw|cf|gps|temp|mag|stab|gnss)", re.MULTILINE
)
_SERIAL = re.compile(r"^\d+\.\d+:")
_UNITS = {"scaledAccel": "g", "scaledGyro": "rad/s"}


def recognizes(head: bytes) -> bool:
    """True if the first lines contain channel names with a serial number, as SensorConnect of MicroStrain writes them."""
    return _CHANNEL.search(head) is not None


def _name_and_unit(name: str, unit: str | None) -> tuple[str, str | None]:
    """Channel name without its serial number, and the given unit, or else the vendor's documented one, or None."""
    channel = _SERIAL.sub("", name)
    known = next((u for start, u in _UNITS.items() if re.match(rf"{start}[XYZ]$", channel)), None)
    return channel, unit or known


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - every channel is a number
    """`Table` of a log of SensorConnect (MicroStrain); the names of several sensors keep the serial numbers."""
    table = text.read(path, text.all_numbers)
    shown = [_name_and_unit(*one) for one in zip(table.names, table.units, strict=True)]
    units = tuple(unit for _, unit in shown)
    serials = {m[0] for name in table.names if (m := _SERIAL.match(name))}
    # Several sensors have the same channels, so that the serial number must stay in the name.
    names = table.names if len(serials) > 1 else tuple(name for name, _ in shown)
    return replace(table, names=names, units=units)


FORMAT = LogFormat(
    "MicroStrain SensorConnect",
    read,
    recognizes=recognizes,
    reads="channels without the serial number; scaled channels in g and rad/s",
)

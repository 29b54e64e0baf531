"""Read logs of sentences with checksums: ``$VN…`` of VectorNav, ``%RAWIMUSA`` and similar ones of NovAtel."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.memory import bytes_text, require_memory
from allanite.readers._format import LogFormat
from allanite.readers._lines import head_of, lines_of
from allanite.readers._table import Picker, Table
from allanite.recording.timebase import read_stamps

#: Beginning of a sentence of an IMU.
_FIRST = re.compile(
    rb"^[ \t]*(?:\$VN(?:IMU|MAR|YMR|QMR|GYR|ACC),"
    rb"|[#%](?:RAWIMUS?X?|CORRIMUDATAS?|IMURATECORRIMUS?)A,)",
    re.MULTILINE,
)
#: Bytes of memory per byte of a log while its fields are held (measured: 6 for VectorNav, 7 for NovAtel).
MEMORY_PER_BYTE = 8.0
#: Maximum fraction of damaged lines in a usable log. Chosen by judgment; not measured.
MAX_DAMAGED = 0.05

_MAG, _ACC, _GYR = (
    [(f"{name}{axis}", unit) for axis in "XYZ"]
    for name, unit in (("Mag", "Gauss"), ("Accel", "m/s^2"), ("Gyro", "rad/s"))
)
#: Fields of VectorNav's sentences and their units (VN-100 user manual, IMU subsystem).
VECTORNAV: dict[str, list[tuple[str, str]]] = {
    "IMU": [*_MAG, *_ACC, *_GYR, ("Temp", "degC"), ("Pressure", "kPa")],
    "MAR": [*_MAG, *_ACC, *_GYR],
    "YMR": [("Yaw", "deg"), ("Pitch", "deg"), ("Roll", "deg"), *_MAG, *_ACC, *_GYR],
    "QMR": [*((f"Quat{k}", "1") for k in range(4)), *_MAG, *_ACC, *_GYR],
    "GYR": _GYR,
    "ACC": _ACC,
}
#: Beginnings of the fields that become columns. Heading, magnetometer and pressure are not analyzed.
_KEPT = ("Accel", "Gyro", "Temp")

#: A foot in m, a degree and an arc second in rad, a milli-g in m/s².
_FOOT, _DEGREE, _ARCSECOND, _MG = 0.3048, math.pi / 180, math.pi / 648000, 9.80665e-3
#: NovAtel's number of an IMU → size of a count in rad and m/s (OEM7 manual, raw IMU scale factors).
INCREMENTS = {
    **dict.fromkeys((1, 5, 11, 20, 27, 28), (2.0**-33, 2.0**-27 * _FOOT)),
    **dict.fromkeys((4, 12), (2.0**-33, 2.0**-26 * _FOOT)),
    8: (2.0**-19, 2.0**-14),
    13: (0.1 / 256 * _ARCSECOND, 0.05 * 2.0**-15),
    **dict.fromkeys((26, 52), (1e-9, 2e-8)),
    31: (720 * 2.0**-31 * _DEGREE, 200 * 2.0**-31),
    **dict.fromkeys((32, 56), (2.0**-21 * _DEGREE, 2.0**-22)),
    **dict.fromkeys((58, 68, 69), (2.0**-33, 2.0**-29)),
}
#: NovAtel's number of an IMU → size of a count in rad/s and m/s², for IMUs that count rates.
RATES = {
    **dict.fromkeys((41, 62), (0.008 / 65536 * _DEGREE, 0.2 / 65536 * _MG)),
    61: (0.0151515 / 65536 * _DEGREE, 0.4 / 65536 * _MG),
}
#: Names of the columns of NovAtel sentences.
_AXES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")


def recognizes(head: bytes) -> bool:
    """True if the first kilobytes of a text contain a sentence of an IMU of VectorNav or NovAtel."""
    return _FIRST.search(head) is not None


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the VectorNav or NovAtel sentences whose kind comes first in the log; other sentences are skipped.

    A damaged sentence is a row of NaN (VectorNav), or has no row (NovAtel, whose rows have times). Raises `InputError`
    if over 5 % of these sentences are damaged, and without a sentence.
    """
    first = _FIRST.search(head_of(path))
    if first is None:
        raise InputError("the log has no sentence of an IMU")
    start = first.group().strip()
    fields_of = _vectornav_fields if start.startswith(b"$") else _novatel_fields
    rows, damaged, at = _read_sentences(path, start, fields_of)
    if not rows or damaged > MAX_DAMAGED * len(rows):
        raise InputError(
            f"{damaged} of {len(rows)} sentences {start.decode()}… are damaged or truncated, the first in line {at}"
        )
    note = (f"{damaged} damaged sentences are missing samples, first in line {at}",) * bool(damaged)
    return (_vectornav_table if start.startswith(b"$") else _novatel_table)(start, rows, note)


def _read_sentences(
    path: Path, start: bytes, fields_of: Callable[[bytes], list[bytes] | None]
) -> tuple[list[list[bytes] | None], int, int]:
    """Fields of each sentence, or None if damaged; number of damaged ones; line of the first damaged one, or 0.

    Sentences begin with `start`; other lines are skipped. `fields_of` returns None for a wrong checksum. A sentence
    with another number of fields than the first sound one is damaged, too. Raises `InputError` for a log beyond the
    memory budget.
    """
    rows: list[list[bytes] | None] = []
    damaged = at = 0
    width = None
    size = path.stat().st_size
    require_memory(MEMORY_PER_BYTE * size, f"a log of {bytes_text(size)}")
    with path.open("rb") as stream:
        for number, line in enumerate(lines_of(stream), start=1):
            text = line.strip()
            if not text.startswith(start):
                continue
            fields = fields_of(text)
            if fields is not None and width is None:
                width = len(fields)
            if fields is None or len(fields) != width:
                fields, damaged, at = None, damaged + 1, at or number
            rows.append(fields)
    return rows, damaged, at


def _vectornav_fields(line: bytes) -> list[bytes] | None:
    """Fields after the name of a VectorNav sentence; None if the checksum (XOR of all bytes, or ``XX``) is wrong."""
    body, _, check = line[1:].partition(b"*")
    if check != b"XX" and check.upper() != b"%02X" % reduce(xor, body, 0):
        return None
    return body.split(b",")[1:]


def _novatel_fields(line: bytes) -> list[bytes] | None:
    """List of the fields after the header of a NovAtel sentence; None if the CRC-32 is wrong."""
    body, _, check = line[1:].partition(b"*")
    crc = zlib.crc32(body, 0xFFFFFFFF) ^ 0xFFFFFFFF
    if check.lower() != b"%08x" % crc:
        return None
    return body.partition(b";")[2].split(b",")


def _numbers_of_fields(rows: list[list[bytes] | None], fields: slice) -> Array:
    """Array of some fields of every row, shape (n, fields), NaN for damaged rows. Raises `InputError` for text."""
    good = [row[fields] for row in rows if row is not None]
    try:
        values = np.array(good, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"a sentence holds text where numbers belong ({error})") from None
    out = np.full((len(rows), values.shape[1]), np.nan)
    out[[row is not None for row in rows]] = values
    return out


def _vectornav_table(start: bytes, rows: list[Any], note: tuple[str, ...]) -> Table:
    """`Table` of accelerations, angular rates and temperature from the fields of VectorNav sentences, without time.

    Raises `InputError` for text, and if the sentences have too few fields.
    """
    fields = VECTORNAV[start[3:6].decode()]
    values = _numbers_of_fields(rows, slice(len(fields)))
    if values.shape[1] < len(fields):
        raise InputError(
            f"sentences {start.decode()}… have {values.shape[1]} fields, not {len(fields)}"
        )
    kept = [i for i, (name, _) in enumerate(fields) if name.startswith(_KEPT)]
    names, units = zip(*(fields[i] for i in kept), strict=True)
    return Table(names, tuple(values[:, i] for i in kept), units, notes=note)


def _novatel_table(start: bytes, rows: list[Any], note: tuple[str, ...]) -> Table:
    """`Table` of angular rates and accelerations from the fields of NovAtel sentences, with the GPS time in s.

    Counts of an IMU of unknown scale stay counts without units, which a note states. Damaged rows are left out. Raises
    `InputError` for text, and if the sentences have too few fields.
    """
    kind = start[1:].rstrip(b"A,").removesuffix(b"S")
    extended = kind.endswith(b"X")
    raw = kind.startswith(b"RAWIMU")
    begin = (2 if extended else 0) + (3 if raw else 2)
    width = len(next(row for row in rows if row is not None))
    if width < begin + 6:
        raise InputError(f"sentences {start.decode()}… have {width} fields, not {begin + 6}")
    values = _numbers_of_fields(rows, slice(begin, begin + 6))
    place = 2 if extended else 0
    stamps = _numbers_of_fields(rows, slice(place, place + 2))
    there = np.isfinite(stamps[:, 0])
    # A damaged line leaves a gap in the stamps, which is filled later.
    values, stamps = values[there], stamps[there]
    time = stamps[:, 0] * 604800.0 + stamps[:, 1]
    # Raw sentences hold Z, −Y, X of the accelerometers, then of the gyroscopes. Corrected ones begin with pitch (about x),
    # roll and yaw.
    columns = values[:, ::-1] * [1, -1, 1, 1, -1, 1] if raw else values
    scale, units = _scale_and_units(rows if extended else [], raw, read_stamps(time, "s").rate)
    if scale is None:
        note = (*note, "counts of an IMU of unknown scale: coefficients are in counts")
        scale = np.ones(6)
    return Table(_AXES, tuple((columns * scale).T), units, time=time, notes=note)


def _scale_and_units(
    rows: list[Any], raw: bool, rate: float
) -> tuple[Array | None, tuple[str | None, ...]]:
    """Factors from logged numbers to rad/s and m/s², shape (6,), and six units; all None if the scale is unknown."""
    units: tuple[str | None, ...] = ("rad/s",) * 3 + ("m/s^2",) * 3
    if not raw:
        return np.full(6, rate), units
    number = next((int(row[1]) for row in rows if row is not None), -1)
    if number in RATES:
        return np.repeat(RATES[number], 3), units
    if number in INCREMENTS:
        return np.repeat(INCREMENTS[number], 3) * rate, units
    return None, (None,) * 6


FORMAT = LogFormat(
    "sentences of VectorNav and NovAtel",
    read,
    recognizes=recognizes,
    reads="the numbers of each sentence whose checksum holds",
)

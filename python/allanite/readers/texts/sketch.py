"""Read the output of Arduino sketches with one line per sensor: ``Rotation X: 0.01, Y: -0.02, Z: 0.00 rad/s``."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import (
    STAMP,
    TERMINAL_NOTE,
    first_lines,
    terminal_times,
    text_lines,
)

# Source: examples of Adafruit's libraries (Adafruit_MPU6050, basic_readings.ino; Adafruit_LSM6DS, …): three lines and
# an empty one for each sample, the unit at the end of each line.
# Possessive, and names and units are short: the time must not grow with the square of a line's length.
_NUMBER = r"[-+]?(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?\d++)?|nan|ovf"
_LINE = re.compile(
    rf"^\s*(?P<name>[A-Za-z][A-Za-z ]{{0,30}}?)\s*X\s*[:=]\s*(?P<x>{_NUMBER})\s*,?\s*Y\s*[:=]\s*(?P<y>{_NUMBER})"
    rf"\s*,?\s*Z\s*[:=]\s*(?P<z>{_NUMBER})\s*(?P<unit>[^\d\s:=][^:=]{{0,20}}?)?\s*$",
    re.IGNORECASE,
)
_SINGLE = re.compile(
    rf"^\s*(?P<name>Temp(?:erature)?)\s*[:=]?\s*(?P<x>{_NUMBER})\s*(?P<unit>[^\d\s:=][^:=]{{0,20}}?)?\s*$",
    re.IGNORECASE,
)
#: Words in these sketches → column names that state the kind of sensor.
_NAMES = {"rotation": "gyro", "acceleration": "acc", "accel": "acc"}
#: Spellings of units in the sketches → units.
_UNITS = {
    "radians/s": "rad/s",
    "rads/s": "rad/s",
    "rps": "rad/s",
    "m/s^2": "m/s^2",
    "degrees C": "degC",
}


def recognizes(head: bytes) -> bool:
    """True if the text looks like the output of a sensor library's example: lines with a sensor's name and three axes.

    Over half of the first lines must hold three axes or a temperature, and at least two a name and three axes.
    """
    lines = [STAMP.sub("", line) for line in first_lines(head)]
    found = [
        m["name"].strip().lower()
        for line in lines
        if (m := _LINE.match(line)) and m["name"].strip()
    ]
    return len(found) >= 2 and 2 * sum(_line_match(line) is not None for line in lines) > len(lines)


def _line_match(line: str) -> re.Match[str] | None:
    """Match object of a line with three axes or a temperature; None for any other line."""
    return _LINE.match(line) or _SINGLE.match(line)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the output of a sensor library's example, which prints each sample as a group of lines.

    A line names one sensor (such as the accelerometer) with its values. A new group begins with every line of the
    sensor that came first in the log. An incomplete last group is left out; another one raises `InputError`. If all
    groups begin with a time stamp of the terminal, which states when the line arrived, these stamps are the time.
    """
    samples: list[dict[str, float]] = []
    units: dict[str, str | None] = {}
    stamps: list[str | None] = []
    begin, at = "", 0
    for number, whole in enumerate(text_lines(path), start=1):
        stamp = STAMP.match(whole)
        match = _line_match(whole[stamp.end() :] if stamp else whole)
        if match is None:
            continue
        begin = begin or match["name"]
        if match["name"] == begin:
            _require_whole_sample(samples, units, at)
            samples.append({})
            stamps.append(stamp["clock"] if stamp else None)
            at = number
        for column, value, unit in _values_of_match(match):
            if column in samples[-1]:
                raise InputError(
                    f"row {number} repeats {column} of the sample that begins in row {at}"
                )
            samples[-1][column] = value
            units.setdefault(column, unit)
    if len(samples) > 1 and samples[-1].keys() != samples[0].keys():
        samples.pop(), stamps.pop()  # cut off by the end of the log
    columns = tuple(np.array([sample[name] for sample in samples]) for name in units)
    table = Table(tuple(units), columns, tuple(units.values()), source="file")
    if None in stamps:
        return table
    return replace(table, time=terminal_times(filter(None, stamps)), notes=(TERMINAL_NOTE,))


def _values_of_match(match: re.Match[str]) -> list[tuple[str, float, str | None]]:
    """Tuples (column name, value, unit or None) of a matched line: three axes, or one temperature."""
    words = plain(match["name"]).strip().lower().replace(" ", "_")
    unit = match["unit"] and _UNITS.get(match["unit"].strip(), plain(match["unit"].strip()))
    if match.re is _SINGLE:
        return [("temperature", _number_or_overflow(match["x"]), unit)]
    name = _NAMES.get(words, words)
    return [(f"{name}_{axis}", _number_or_overflow(match[axis]), unit) for axis in "xyz"]


def _number_or_overflow(text: str) -> float:
    """Float of a text; NaN for the overflow mark ``ovf``."""
    return float("nan") if text.lower() == "ovf" else float(text)


def _require_whole_sample(
    samples: list[dict[str, float]], units: dict[str, str | None], line: int
) -> None:
    """Raise `InputError` if the last sample, which begins in row `line`, lacks a column of `units`."""
    if samples and samples[-1].keys() != units.keys():
        lacking = ", ".join(units.keys() - samples[-1].keys())
        raise InputError(f"the sample that begins in row {line} has no {lacking}")


FORMAT = LogFormat(
    "prints of a sketch (`Rotation X: 0.1, Y: 0.2, Z: 0.3 rad/s`)",
    read,
    recognizes=recognizes,
    reads="one sample from each group of lines, with the printed units",
)

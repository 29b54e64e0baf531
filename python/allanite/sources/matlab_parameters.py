"""Noise parameters of MATLAB's imuSensor: a script with gyroparams/accelparams, or a loadparams JSON file.

MATLAB documentation, imuSensor, gyroparams: ``NoiseDensity`` in (rad/s)/sqrt(Hz), one-sided unless ``NoiseType`` is
"double-sided"; ``BiasInstability`` in rad/s; ``RandomWalk`` in (rad/s)*sqrt(Hz). One number stands for three axes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.common.errors import InputError
from allanite.sources.documents import model_document

#: (Property of imuSensor, function that makes its parameters, unit of its samples) of each kind of sensor.
SENSORS = (("Gyroscope", "gyroparams", "rad/s"), ("Accelerometer", "accelparams", "m/s^2"))
#: (Field of MATLAB's parameters, coefficient).
FIELDS = (("NoiseDensity", "N"), ("BiasInstability", "B"), ("RandomWalk", "K"))
#: Pattern of a MATLAB number or of a list in square brackets.
_NUMBERS = r"\[[^\]]*\]|[-+.\deE]+"


def documents_of_script(text: str, source: str) -> list[dict[str, Any]]:
    """List of model documents (dicts) from the text of a MATLAB script, one per axis.

    The script has name-value pairs in gyroparams(…) or accelparams(…), or assignments such as
    ``imu.Gyroscope.NoiseDensity = …``. Raises `InputError` without a sensor, for a sensor without a noise density above
    0, and for a value that is not one or three numbers.
    """
    text = re.sub(r"%.*", "", text).replace("...", " ")
    rate = re.search(r"SampleRate['\"]?\s*[,=]\s*([\d.eE+-]+)", text)
    found = []
    for sensor, maker, unit in SENSORS:
        value = rf"({_NUMBERS}|['\"][\w-]+['\"])"
        call = re.search(rf"\b{maker}\s*\((.*?)\)\s*;?", text, re.DOTALL)
        pairs = re.findall(rf"['\"](\w+)['\"]\s*,\s*{value}", call[1]) if call else []
        given = dict([*pairs, *re.findall(rf"\b{sensor}\.(\w+)\s*=\s*{value}", text)])
        if given:
            parts = {key: value.strip("'\"[] ").replace(",", " ") for key, value in given.items()}
            found += _axis_documents(parts, sensor, unit, source, None if rate is None else rate[1])
    if not found:
        raise InputError(
            "this MATLAB script has no gyroparams(…) or accelparams(…) with a NoiseDensity"
        )
    return found


def sensor_parts(tree: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """List of the dicts in a parsed loadparams file that have a dict Gyroscope or Accelerometer.

    They are the document itself, or entries of it, one per sensor product. Empty if the document is no loadparams file.
    """
    return [
        part
        for part in (tree, *tree.values())
        if isinstance(part, dict) and any(isinstance(part.get(s), dict) for s, _, _ in SENSORS)
    ]


def documents_of_parts(parts: Sequence[Mapping[str, Any]], source: str) -> list[dict[str, Any]]:
    """List of model documents (dicts) from the only one of the `sensor_parts` of a loadparams file, one per axis.

    Raises `InputError` for more than one part (sensor product).
    """
    if len(parts) > 1:
        raise InputError(
            f"contains {len(parts)} parts, but only one can be used: delete the others"
        )
    found = []
    for sensor, _, unit in SENSORS:
        own = parts[0].get(sensor)
        if isinstance(own, dict):
            texts = {
                key: " ".join(map(str, value)) if isinstance(value, list) else str(value)
                for key, value in own.items()
            }
            found += _axis_documents(texts, sensor, unit, source, None)
    return found


def _axis_documents(
    given: Mapping[str, str], sensor: str, unit: str, source: str, rate: str | None
) -> list[dict[str, Any]]:
    """List of model documents (dicts): three named x, y, z if any field has three numbers, else one for the sensor.

    A field with one number applies to all axes. NoiseDensity is divided by √2 unless NoiseType is double-sided. Raises
    `InputError` without a noise density above 0.
    """
    numbers = {
        letter: _one_or_three_numbers(given[key], key) for key, letter in FIELDS if key in given
    }
    if not any(numbers.get("N", ())):
        raise InputError(f"{sensor} has no NoiseDensity above 0")
    two_sided = given.get("NoiseType", "").lower() in ("double-sided", "two-sided")
    if not two_sided:
        numbers["N"] = [n / math.sqrt(2.0) for n in numbers["N"]]
    side = (
        "NoiseType double-sided: N = NoiseDensity"
        if two_sided
        else "NoiseDensity is one-sided (MATLAB's default): N = NoiseDensity / sqrt(2)"
    )
    count = max(len(values) for values in numbers.values())
    names = [f"{sensor.lower()} {axis}" for axis in "xyz"] if count == 3 else [sensor.lower()]
    return [
        model_document(
            name,
            unit,
            {k: v[i if len(v) > 1 else 0] for k, v in numbers.items() if any(v)},
            source,
            None if rate is None else float(rate),
            [side],
        )
        for i, name in enumerate(names)
    ]


def _one_or_three_numbers(text: str, key: str) -> list[float]:
    """List of the one or three non-negative numbers in the text of a field. Raises `InputError` for any other text."""
    try:
        found = [float(word) for word in text.split()]
    except ValueError:
        found = []
    if len(found) not in (1, 3) or not all(0.0 <= v < math.inf for v in found):
        raise InputError(f"{key} = {text[:60]!r}: give one number or three numbers, not negative")
    return found

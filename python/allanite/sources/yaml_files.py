"""Results of other tools in YAML: Kalibr's imu.yaml and imu_utils' imu_param.yaml.

Kalibr (wiki "IMU Noise Model"): continuous-time, two-sided densities N and K in SI units.
imu_utils (src/gyr_lib/fitallan_gyr.cpp at 2cdda91): ``gyr_n`` is sqrt(rate) times the Allan deviation at 1 s, the
deviation of a sample; ``gyr_w`` is the minimum of the Allan deviation, a bias stability and no random walk.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from allanite.common.documents import text_of
from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.sources.documents import PLATEAU, model_document

#: (Name in Kalibr's keys, name in imu_utils' keys, unit of the samples) of each kind of sensor.
SENSORS = (("gyroscope", "gyr", "rad/s"), ("accelerometer", "acc", "m/s^2"))
#: Kalibr's keys of N and K, after the name of the sensor.
KALIBR = ("noise_density", "random_walk")
#: Maximum size in bytes and maximum nesting depth of a YAML file. The files of both tools have a few hundred bytes and 3
#: levels. The parser needs 10 µs per byte, and a time that grows with the square of the depth.
MAX_FILE_BYTES, MAX_DEPTH = 100_000, 20


def _refuse_aliases_and_depth(text: str) -> None:
    """Raise `InputError` if a YAML text has aliases (which can expand to gigabytes) or more than `MAX_DEPTH` levels."""
    depth = 0
    for event in yaml.parse(text, yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent):
            raise InputError("YAML with aliases (*name) is not read: write the values")
        if depth > MAX_DEPTH:
            raise InputError(f"more than {MAX_DEPTH} levels, not a file of these tools")


def documents_of_yaml(path: Path, rate: float | None) -> list[dict[str, Any]]:
    """List of model documents (dicts) from a YAML file of Kalibr or imu_utils, one per sensor or axis.

    `rate`, Hz, is that of the log that imu_utils analyzed, because its file does not contain it. Raises `InputError`
    for a file of neither kind, for a value that is not a positive number, and without the rate for imu_utils.
    """
    text = text_of(path, MAX_FILE_BYTES, errors="replace")
    # OpenCV writes "%YAML:1.0", which is not a valid YAML directive.
    text = re.sub(r"\A%YAML:[\d.]+", "", text)
    try:
        _refuse_aliases_and_depth(text)
        tree = yaml.safe_load(text)
    except InputError:
        raise
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:
        place = getattr(error, "problem_mark", None)
        row = f" (line {place.line + 1})" if place is not None else ""
        raise InputError(f"not a YAML file{row}") from None
    top = (tree, *tree.values()) if isinstance(tree, dict) else ()
    nodes = [node for node in top if isinstance(node, dict)]
    kalibr = [n for n in nodes if any(f"{s}_{KALIBR[0]}" in n for s, _, _ in SENSORS)]
    if kalibr:
        return [d for node in kalibr for d in _kalibr_documents(node, str(path), len(kalibr) > 1)]
    if isinstance(tree, dict) and ("Gyr" in tree or "Acc" in tree):
        return _imu_utils_documents(tree, str(path), rate)
    raise InputError(
        "neither a Kalibr file (gyroscope_noise_density) nor one of imu_utils (Gyr, Acc)"
    )


def _kalibr_documents(node: Mapping[str, Any], source: str, several: bool) -> list[dict[str, Any]]:
    """List of model documents (dicts) of one IMU in a Kalibr file, one per sensor; with `several`, named by ROS topic.

    Sensors without a noise density are left out. Raises `InputError` unless N and K are positive numbers.
    """
    rate = node.get("update_rate")
    found = []
    for sensor, _, unit in SENSORS:
        if f"{sensor}_{KALIBR[0]}" not in node:
            continue
        N, K = (_positive_number(node, f"{sensor}_{key}") for key in KALIBR)
        name = f"{node.get('rostopic', sensor)} {sensor}" if several else sensor
        assumptions = [
            "Kalibr file: N and K are taken as continuous-time, two-sided densities; they were not fitted by allanite"
        ]
        found.append(model_document(name, unit, {"N": N, "K": K}, source, rate, assumptions))
    return found


def _imu_utils_documents(
    tree: Mapping[str, Any], source: str, rate: float | None
) -> list[dict[str, Any]]:
    """List of model documents (dicts) of an imu_utils file: three axes per sensor if all are present, else their average.

    N is the file's noise per sample divided by √rate, B its minimum of the Allan deviation divided by 0.664. Raises
    `InputError` without the rate, and for a number that is missing or not positive.
    """
    if rate is None:
        raise InputError(
            "imu_utils states the noise per sample but not the sampling rate of the log",
            missing="rate",
            remedy=": give the rate of that log with {rate}",
        )
    found = []
    for sensor, short, unit in SENSORS:
        node = tree.get(short.capitalize())
        if not isinstance(node, dict):
            continue
        axes = [a for a in ("x-axis", "y-axis", "z-axis") if isinstance(node.get(a), dict)]
        for axis in axes if len(axes) == 3 else ["avg-axis"]:
            part = node.get(axis)
            if not isinstance(part, dict):
                raise InputError(f"{short.capitalize()} has no {axis}")
            noise = _positive_number(part, f"{short}_n")
            floor = _positive_number(part, f"{short}_w")
            values = {"N": noise / math.sqrt(rate), "B": floor / PLATEAU}
            white = (
                f"imu_utils file, log at {rate:g} Hz: {short}_n is the standard deviation of a sample,"
                f" N = {short}_n / sqrt(rate)"
            )
            slow = f"{short}_w is the minimum of the Allan deviation, not a random walk: B = {short}_w / 0.664"
            assumptions = [white, slow]
            name = f"{sensor} {axis}"
            found.append(model_document(name, unit, values, source, rate, assumptions))
    return found


def _positive_number(node: Mapping[str, Any], key: str) -> float:
    """Value of `key` in a file as a float. Raises `InputError` if it is missing, no number, not positive or infinite."""
    try:
        value = float(node[key])
    except KeyError:
        raise InputError(f"{key} is missing") from None
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{key} = {plain(node[key], 60)} is not a number") from None
    if not 0.0 < value < math.inf:
        raise InputError(f"{key} = {value:g} must be positive")
    return value

"""CARLA: Python code with the attributes of the IMU blueprint. CARLA only simulates white noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.exports._axis import gyro_and_accel_axes, rate_of
from allanite.exports._head import head_comments
from allanite.exports._lines import choose_all
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.exports._axis import Axis


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a Python file: dict of blueprint attributes with the standard deviation of a sample, N·√rate.

    InertialMeasurementUnit.cpp adds white noise and a constant bias. Each of x, y and z has its own numbers. Raises
    `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "carla")
    pairs = []
    convention = [
        f"CARLA (sensor.other.imu): standard deviation per sample at {fs:g} Hz, N*sqrt(rate).",
        "CARLA's bias is constant, so this file cannot hold slow noise.",
    ]
    lines = []
    for own, sensor in zip(gyro_and_accel_axes(axes), ("gyro", "accel"), strict=True):
        if not own:
            continue
        numbers = choose_all(own, overbound=overbound, simulator=True)
        pairs += numbers
        places, axis_remarks = numbers_in_xyz(own, [(c.N,) for _, c in numbers])
        convention += [f"{sensor} {line}" for line in axis_remarks]
        lines += [
            f'    "noise_{sensor}_stddev_{axis}": "{white * math.sqrt(fs):.6e}",\n'
            for axis, (white,) in zip("xyz", places, strict=True)
        ]
    return as_comments(head_comments(pairs, convention, simulator=True)) + (
        "imu_attributes = {\n" + "".join(lines) + f'    "sensor_tick": "{1 / fs:.6e}",\n}}\n\n\n'
        "def set_on(blueprint):\n    for name, value in imu_attributes.items():\n"
        "        blueprint.set_attribute(name, value)\n"
    )


TARGETS = (Target("carla", "CARLA", "carla_imu.py", render, whole_record=True),)

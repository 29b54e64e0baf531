"""CARLA: Python code with the attributes of the IMU blueprint. CARLA only simulates white noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis, rate_of
from allanite.exports._choice import choose
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import triads_of


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a Python file: dict of blueprint attributes with the standard deviation of a sample, N·√rate, of x, y and z.

    InertialMeasurementUnit.cpp adds white noise and a constant bias. Raises `InputError` if `rate` is None and the axes
    have no common rate.
    """
    fs = rate_of(axes, rate, "carla")
    convention = [
        f"CARLA (sensor.other.imu): standard deviation per sample at {fs:g} Hz, N*sqrt(rate).",
        "CARLA's bias is constant, so this file cannot hold slow noise.",
    ]
    chosen = partial(choose, overbound=overbound, simulator=True)
    found = triads_of(axes, ("gyro", "accel"), chosen, ["N"])
    lines = [
        f'    "noise_{sensor}_stddev_{axis}": "{white * math.sqrt(fs):.6e}",\n'
        for sensor, places in found.numbers.items()
        for axis, white in zip("xyz", places["N"], strict=True)
    ]
    notes = head_comments(found.pairs, [*convention, *found.remarks], simulator=True)
    return as_comments(notes) + (
        "imu_attributes = {\n" + "".join(lines) + f'    "sensor_tick": "{1 / fs:.6e}",\n}}\n\n\n'
        "def set_on(blueprint):\n    for name, value in imu_attributes.items():\n"
        "        blueprint.set_attribute(name, value)\n"
    )


TARGETS = (Target("carla", "CARLA", "carla_imu.py", render, whole_record=True),)

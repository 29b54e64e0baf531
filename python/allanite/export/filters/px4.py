"""PX4's EKF2 parameters: deviations per step of the filter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.export._initial import initial_lines
from allanite.export._lines import value_lines
from allanite.export._target import Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS"]

#: EKF2_PREDICT_US = 10 000: the filter's own rate, whatever the sensor's, Hz.
FILTER_RATE = 100.0
#: Range that the parameter's description allows (ekf2_params.c).
RANGES = {
    "EKF2_GYR_NOISE": (1e-4, 0.1),
    "EKF2_ACC_NOISE": (0.01, 1.0),
    "EKF2_GYR_B_NOISE": (0.0, 0.01),
    "EKF2_ACC_B_NOISE": (0.0, 0.01),
}
#: Deviation of the bias at switch-on, rad/s and m/s^2 (ekf2_params.c).
INITIAL = {"gyro": "EKF2_GBIAS_INIT", "accel": "EKF2_ABIAS_INIT"}
#: MAVLink's number of a 32-bit floating-point parameter.
REAL32 = 9
ROWS = (
    ("EKF2_GYR_NOISE", "gyro", "N", "rad/s, deviation per step"),
    ("EKF2_ACC_NOISE", "accel", "N", "m/s^2, deviation per step"),
    ("EKF2_GYR_B_NOISE", "gyro", "K", "rad/s^2, deviation of a bias step over dt"),
    ("EKF2_ACC_B_NOISE", "accel", "K", "m/s^3, deviation of a bias step over dt"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Commands of PX4's shell: N/√dt and K/√dt with dt of the filter, whose variances are (dt·σ)²."""
    form = "param set {key} {value:.6e}  {note}"
    return _file(axes, rate, form, overbound=overbound)


def render_tabs(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """A file that QGroundControl loads: system, component, name, value and type of each parameter, parted by tabs."""
    form = f"{{note}}\n1\t1\t{{key}}\t{{value:.9g}}\t{REAL32}"
    return _file(axes, rate, form, overbound=overbound)


def _file(axes: Sequence[Axis], rate: float | None, form: str, *, overbound: bool) -> str:
    fs = rate or FILTER_RATE
    convention = (
        f"PX4 EKF2: per step of the filter, {fs:g} Hz (EKF2_PREDICT_US, or the rate given), not of the sensor;",
        "deviations: N*sqrt(rate), K*sqrt(rate). Vibration in flight is not in a record at rest: keep larger defaults.",
    )
    convert = {"N": lambda v: v * math.sqrt(fs), "K": lambda v: v * math.sqrt(fs)}
    text = value_lines(
        axes, ROWS, convert, convention, overbound=overbound, form=form, ranges=RANGES
    )
    return text + initial_lines(axes, INITIAL, form, overbound=overbound)


TARGETS = (
    Target("px4", "PX4 (shell)", "px4.sh", render, own_rate=True),
    Target("px4-params", "PX4 (QGroundControl)", "px4.params", render_tabs, own_rate=True),
)

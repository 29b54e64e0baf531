"""PX4 EKF2 parameters: standard deviations per step of the filter."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._initial import initial_lines
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

#: Rate of the filter, whatever the rate of the sensor, Hz: EKF2_PREDICT_US = 10 000.
FILTER_RATE = 100.0
#: Documented range of each parameter (ekf2_params.c).
RANGES = {
    "EKF2_GYR_NOISE": (1e-4, 0.1),
    "EKF2_ACC_NOISE": (0.01, 1.0),
    "EKF2_GYR_B_NOISE": (0.0, 0.01),
    "EKF2_ACC_B_NOISE": (0.0, 0.01),
}
#: Parameters for the standard deviation of the bias at switch-on, rad/s and m/s^2 (ekf2_params.c).
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
    """Text with commands of PX4's shell that set N/√dt, K/√dt and the bias at switch-on.

    The step dt of the filter is 1/`rate`, by default 0.01 s. The filter uses the variances (dt·σ)². Each number is the
    largest of the axes of its sensor.
    """
    form = "param set {key} {value:.6e}  {note}"
    return _parameter_lines(axes, rate, form, overbound=overbound)


def render_tabs(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text for QGroundControl, one line per parameter: system, component, name, value and type, separated by tabs.

    The values are N/√dt, K/√dt and the bias at switch-on, each the largest of the axes of its sensor. The step dt of the
    filter is 1/`rate`, by default 0.01 s.
    """
    form = f"{{note}}\n1\t1\t{{key}}\t{{value:.9g}}\t{REAL32}"
    return _parameter_lines(axes, rate, form, overbound=overbound)


def _parameter_lines(
    axes: Sequence[Axis], rate: float | None, form: str, *, overbound: bool
) -> str:
    """Text of a file with one entry per parameter, in the format `form`: N/√dt, K/√dt and the bias at switch-on.

    Each value is the largest of the axes of its sensor. The step dt of the filter is 1/`rate`, by default 0.01 s. With
    `overbound`, N and K cover the 95 % limits.
    """
    fs = rate or FILTER_RATE
    convention = (
        f"PX4 EKF2: standard deviations per step of the filter, N*sqrt(rate) and K*sqrt(rate), here at {fs:g} Hz. The rate",
        "is that of the filter (EKF2_PREDICT_US), not of the sensor. A record at rest does not contain the vibration of",
        "flight: keep a default that is larger.",
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

"""PX4's EKF2 parameters: deviations per step of the filter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.export._lines import value_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]

#: EKF2_PREDICT_US = 10 000: the filter's own rate, whatever the sensor's, Hz.
FILTER_RATE = 100.0
ROWS = (
    ("EKF2_GYR_NOISE", "gyro", "N", "rad/s, deviation per step"),
    ("EKF2_ACC_NOISE", "accel", "N", "m/s^2, deviation per step"),
    ("EKF2_GYR_B_NOISE", "gyro", "K", "rad/s^2, deviation of a bias step over dt"),
    ("EKF2_ACC_B_NOISE", "accel", "K", "m/s^3, deviation of a bias step over dt"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N/√dt and K/√dt with dt of the filter: its variances are (dt·σ)²; it allows values up to 1."""
    fs = rate or FILTER_RATE
    convention = (
        f"PX4 EKF2: per step of the filter, {fs:g} Hz (EKF2_PREDICT_US, or the rate given), not of the sensor;",
        "deviations: N*sqrt(rate), K*sqrt(rate). Vibration in flight is not in a record at rest: keep larger defaults.",
    )
    convert = {"N": lambda v: v * math.sqrt(fs), "K": lambda v: v * math.sqrt(fs)}
    return value_lines(
        axes,
        ROWS,
        convert,
        convention,
        overbound=overbound,
        form="param set {key} {value:.6e}  {note}",
    )

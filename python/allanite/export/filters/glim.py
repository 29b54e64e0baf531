"""GLIM: config_sensors.json, densities for GTSAM's preintegration and one bias step from scan to scan."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from allanite.export._axis import split
from allanite.export._head import head
from allanite.export._lines import chosen, largest, needs_both, shared
from allanite.export._target import Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS"]

#: Scans a second of a usual LiDAR, from one of which to the next the bias may step.
SCAN_RATE = 10.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N as density, squared by imu_integration.cpp; K/√(scan rate) as the deviation of the bias from scan to scan.

    odometry_estimation_imu.cpp (koide3 d1c23be) has one deviation for the six biases: the larger of both sensors'.
    """
    needs_both(axes, "glim")
    scans = rate or SCAN_RATE
    gyro, accel = (chosen(own, overbound=overbound) for own in split(axes))
    convention = (
        "GLIM: imu_acc_noise and imu_gyro_noise are densities, continuous time, two-sided; imu_bias_noise is the step of a",
        f"bias from scan to scan, K/sqrt(scan rate), here at {scans:g} Hz or the rate given, the larger one.",
    )
    values = {
        "imu_acc_noise": largest(accel, "N")[0],
        "imu_gyro_noise": largest(gyro, "N")[0],
        "imu_int_noise": 1e-8,
        "imu_bias_noise": max(largest(own, "K")[0] for own in (gyro, accel)) / math.sqrt(scans),
    }
    whole = {"_comment": head([*shared(gyro), *shared(accel)], convention), "sensors": values}
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


TARGETS = (Target("glim", "GLIM", "config_sensors.json", render, own_rate=True),)

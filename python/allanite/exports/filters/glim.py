"""GLIM config_sensors.json: densities for GTSAM's preintegration, and the bias step from scan to scan."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._head import head_comments
from allanite.exports._lines import choose_all, largest_number, with_shared_numbers
from allanite.exports._target import Target

#: Scan rate of a usual LiDAR, Hz. The bias steps from scan to scan.
SCAN_RATE = 10.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """JSON text: N in SI, and K/√(scan rate) as standard deviation of the bias change per scan of the LiDAR.

    The scan rate is `rate`, by default 10 Hz. imu_integration.cpp squares N. odometry_estimation_imu.cpp (koide3
    d1c23be) uses one number for all six biases: the larger one of both sensors is written.
    """
    scans = rate or SCAN_RATE
    gyro, accel = (choose_all(own, overbound=overbound) for own in gyro_and_accel_axes(axes))
    convention = (
        "GLIM: imu_acc_noise and imu_gyro_noise are continuous-time, two-sided densities. imu_bias_noise is the standard",
        f"deviation of a bias step from scan to scan, K/sqrt(scan rate), here for {scans:g} scans per second. GLIM uses",
        "one number for gyroscope and accelerometer: the larger one.",
    )
    values = {
        "imu_acc_noise": largest_number(accel, "N")[0],
        "imu_gyro_noise": largest_number(gyro, "N")[0],
        "imu_int_noise": 1e-8,
        "imu_bias_noise": max(largest_number(own, "K")[0] for own in (gyro, accel))
        / math.sqrt(scans),
    }
    whole = {
        "_comment": head_comments(with_shared_numbers(gyro, accel), convention),
        "sensors": values,
    }
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


TARGETS = (Target("glim", "GLIM", "config_sensors.json", render, own_rate=True, both_sensors=True),)

"""Kimera-VIO ImuParams.yaml: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import check_both_sensors, value_lines
from allanite.exports._target import Target
from allanite.exports.filters.kalibr import ROWS


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of ImuParams.yaml: N and K in SI, not converted, and the other keys that ImuFrontendParams.cpp reads.

    ImuFrontend.cpp squares the densities for GTSAM (MIT-SPARK 293b4ff). The file selects preintegration type 1. The
    combined factor (type 0) adds the identity to the covariance of the bias, and no parameter changes this. Each number
    is the largest of the axes of its sensor. Raises `InputError` unless both sensors and one sampling rate are known.
    """
    update = rate_of(axes, rate, "kimera")
    check_both_sensors(axes, "kimera")
    convention = (
        "Kimera-VIO: continuous-time, two-sided densities. The program squares them for GTSAM's preintegration.",
    )
    numbers = value_lines(axes, ROWS, {}, convention, overbound=overbound)
    rest = (
        "imu_preintegration_type: 1  # ImuFactor; CombinedImuFactor (0) adds the identity to the bias covariance\n"
        "T_BS:\n  cols: 4\n  rows: 4\n"
        "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
        f"rate_hz: {update:g}\n"
        "imu_integration_sigma: 1.0e-8\nimu_time_shift: 0.0\nn_gravity: [0.0, 0.0, -9.81]\n"
    )
    return f"%YAML:1.0\n{numbers}{rest}"


TARGETS = (Target("kimera", "Kimera-VIO", "ImuParams.yaml", render),)

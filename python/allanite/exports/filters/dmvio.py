"""DM-VIO settings file: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._lines import check_both_sensors, value_lines
from allanite.exports._target import Target

ROWS = (
    ("accelerometer_noise_density", "accel", "N", "m/s^2/sqrt(Hz), two-sided"),
    ("gyroscope_noise_density", "gyro", "N", "rad/s/sqrt(Hz), two-sided"),
    ("accelerometer_random_walk", "accel", "K", "m/s^3/sqrt(Hz), two-sided"),
    ("gyroscope_random_walk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of lines ``key: value`` with N and K in SI, not converted; `rate` is not used.

    GTSAM's preintegration squares N. The bias changes by K·√Δt between frames (IMUUtils.cpp, fcc306b). Each number is
    the largest of the axes of its sensor. Raises `InputError` unless both sensors are given.
    """
    check_both_sensors(axes, "dmvio")
    convention = (
        "DM-VIO: continuous-time, two-sided densities. Copy these lines into the settings file.",
        "The example files of DM-VIO have larger numbers: they also cover vibration, which a record at rest does not show.",
    )
    lines = value_lines(axes, ROWS, {"N": float, "K": float}, convention, overbound=overbound)
    return lines + (
        "# Error of the integration itself: negligible. DM-VIO's default would be 0.1.\n"
        "integration_sigma: 1.0e-08\n"
    )


TARGETS = (Target("dmvio", "DM-VIO", "dmvio.yaml", render),)

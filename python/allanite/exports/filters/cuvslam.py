"""cuVSLAM of Isaac ROS: parameters of its node, with the conventions of Kalibr (continuous-time, two-sided)."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import check_both_sensors, value_lines
from allanite.exports._target import Target

ROWS = (
    ("gyro_noise_density", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("gyro_random_walk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
    ("accel_noise_density", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("accel_random_walk", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a YAML file with N and K in SI, not converted, and the sampling rate.

    cuvslam.h refers to Kalibr's noise model for the units. Each number is the largest of the axes of its sensor. Raises
    `InputError` unless both sensors and one sampling rate are known.
    """
    check_both_sensors(axes, "cuvslam")
    fs = rate_of(axes, rate, "cuvslam")
    convention = (
        "cuVSLAM (isaac_ros_visual_slam): Kalibr's noise model with continuous-time, two-sided densities.",
    )
    form = "    {key}: {value:.6e}  {note}"
    node = "visual_slam_node:\n  ros__parameters:\n    enable_imu_fusion: true\n"
    numbers = value_lines(axes, ROWS, {}, convention, overbound=overbound, form=form, node=node)
    return f"{numbers}    calibration_frequency: {fs:.6e}  # Hz\n"


TARGETS = (Target("cuvslam", "cuVSLAM (Isaac ROS)", "isaac-ros-visual-slam.yaml", render),)

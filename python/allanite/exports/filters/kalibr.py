"""Kalibr imu.yaml: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("accelerometer_noise_density", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("accelerometer_random_walk", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
    ("gyroscope_noise_density", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("gyroscope_random_walk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of imu.yaml: noise density is N and random walk is K in SI, as in "IMU Noise Model" of Kalibr's wiki.

    There, the standard deviation of a sample is N/√dt, and of a bias step K·√dt. Kalibr refuses values of 0. Each
    number is the largest of the axes of its sensor. The update rate is `rate`; if it is None, it is the highest rate of
    the axes. Raises `InputError` without any rate.
    """
    logged = sorted({axis.rate for axis in axes if axis.rate is not None})
    # N and K hold at any rate. A driver that merges two topics publishes at the rate of the faster one.
    apart = rate is None and len(logged) > 1
    update = logged[-1] if apart else rate_of(axes, rate, "kalibr")
    slower = f"; the slower sensor was logged at {logged[0]:g} Hz" if apart else ""
    convention = (
        "Kalibr and OpenVINS: continuous-time, two-sided densities. The programs apply sqrt(dt) themselves.",
    )
    text = value_lines(axes, ROWS, {}, convention, overbound=overbound)
    return text + f"rostopic: /imu0\nupdate_rate: {update:g}  # Hz{slower}\n"


TARGETS = (Target("kalibr", "Kalibr", "kalibr.yaml", render),)

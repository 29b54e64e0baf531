"""ORB-SLAM3 settings: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("IMU.NoiseGyro", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("IMU.NoiseAcc", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("IMU.GyroWalk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
    ("IMU.AccWalk", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of YAML lines with N and K in SI, not converted, and the sampling rate, rounded to an integer.

    ORB-SLAM3 itself multiplies N by √frequency and divides K by √frequency. Its loader refuses a frequency that is not
    an integer, and noises that are not written as real numbers. Each number is the largest of the axes of its sensor.
    Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "orbslam3")
    convention = (
        "ORB-SLAM3: continuous-time, two-sided densities. The program applies sqrt(IMU.Frequency) itself.",
    )
    text = value_lines(axes, ROWS, {}, convention, overbound=overbound)
    whole = max(1, round(fs))
    near = (
        f"  # Hz; rounded from {fs:.6g} Hz, because the loader requires an integer"
        if abs(whole - fs) > 1e-6 * fs
        else "  # Hz"
    )
    return text + f"IMU.Frequency: {whole}{near}\n"


TARGETS = (Target("orbslam3", "ORB-SLAM3", "orbslam3.yaml", render),)

"""FAST-LIVO2, section imu: variances per sample. The variances of the biases are constants in its source code."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("  acc_cov", "accel", "N", "(m/s^2)^2, variance per sample"),
    ("  gyr_cov", "gyro", "N", "(rad/s)^2, variance per sample"),
    ("# set_acc_bias_cov", "accel", "K", "(m/s^3)^2, variance of a bias step over dt^2"),
    ("# set_gyr_bias_cov", "gyro", "K", "(rad/s^2)^2, variance of a bias step over dt^2"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of the YAML node ``imu`` with N²·rate, and comments with K²·rate.

    FAST-LIVO2 has constants in its source code instead of K²·rate; the comments say what to write there.
    IMU_Processing.cpp (107acae) multiplies both by dt² at each sample. Each number is the largest of the axes of its
    sensor. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "fastlivo2")
    convention = (
        f"FAST-LIVO2: variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "The variances of the biases are constants in LIVMapper.cpp (0.0001). Put the values of the commented lines there.",
    )
    convert = {"N": lambda v: v * v * fs, "K": lambda v: v * v * fs}
    whole = value_lines(axes, ROWS, convert, convention, overbound=overbound)
    at = min(whole.find(key) for key in ("  acc_cov", "  gyr_cov") if key in whole)
    return f"{whole[:at]}imu:\n{whole[at:]}"


TARGETS = (Target("fastlivo2", "FAST-LIVO2", "fastlivo2.yaml", render),)

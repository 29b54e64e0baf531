"""Point-LIO, section mapping: variances per sample for its prediction and for its measurements."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("gyr_cov_input", "gyro", "N", "(rad/s)^2, variance per sample"),
    ("acc_cov_input", "accel", "N", "(m/s^2)^2, variance per sample"),
    ("imu_meas_omg_cov", "gyro", "N", "(rad/s)^2, variance per sample"),
    ("imu_meas_acc_cov", "accel", "N", "(m/s^2)^2, variance per sample"),
    ("b_gyr_cov", "gyro", "K", "(rad/s^2)^2, variance of a bias step over dt^2"),
    ("b_acc_cov", "accel", "K", "(m/s^3)^2, variance of a bias step over dt^2"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key: value`` with N²·rate and K²·rate.

    esekfom.hpp (bbd402a) adds Q·dt² per prediction, and R_IMU is the variance of a sample. Each number is the largest
    of the axes of its sensor. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "pointlio")
    convention = (
        f"Point-LIO (copy below mapping:): variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "They hold with prop_at_freq_of_imu: 1. The _input lines are used with use_imu_as_input: 1, the imu_meas lines",
        "with use_imu_as_input: 0. vel_cov, gyr_cov_output and acc_cov_output describe the vehicle: keep yours.",
    )
    convert = {"N": lambda v: v * v * fs, "K": lambda v: v * v * fs}
    return value_lines(axes, ROWS, convert, convention, overbound=overbound)


TARGETS = (Target("pointlio", "Point-LIO", "pointlio.yaml", render),)

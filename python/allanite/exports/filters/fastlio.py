"""FAST-LIO2, section mapping: variances per sample."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("acc_cov", "accel", "N", "(m/s^2)^2, variance per sample"),
    ("gyr_cov", "gyro", "N", "(rad/s)^2, variance per sample"),
    ("b_acc_cov", "accel", "K", "(m/s^3)^2, variance of a bias step over dt^2"),
    ("b_gyr_cov", "gyro", "K", "(rad/s^2)^2, variance of a bias step over dt^2"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key: value`` with N²·rate and K²·rate, because the filter adds dt²·Q per sample.

    Each number is the largest of the axes of its sensor. Raises `InputError` if `rate` is None and the axes have no
    common rate.
    """
    fs = rate_of(axes, rate, "fastlio")
    convention = (
        f"FAST-LIO2 (copy below mapping:): variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "The filter makes one prediction per IMU sample. It scales the acceleration to m/s^2 itself.",
    )
    convert = {"N": lambda v: v * v * fs, "K": lambda v: v * v * fs}
    return value_lines(axes, ROWS, convert, convention, overbound=overbound)


TARGETS = (Target("fastlio", "FAST-LIO", "fastlio.yaml", render),)

"""VINS-Mono and VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w, all per sample."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("acc_n", "accel", "N", "m/s^2, deviation per sample times sqrt(2)"),
    ("gyr_n", "gyro", "N", "rad/s, deviation per sample times sqrt(2)"),
    ("acc_w", "accel", "K", "m/s^3, deviation of a bias step over dt"),
    ("gyr_w", "gyro", "K", "rad/s^2, deviation of a bias step over dt"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key: value`` with N·√(2·rate) and K·√rate.

    The midpoint rule of integration_base.h averages two independent noises per step. The variance of a step is then
    n²dt²/2, which gives n = N√(2/dt). A bias step is w·dt, which gives w = K/√dt. Each number is the largest of the
    axes of its sensor. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "vins")
    convention = (
        f"VINS: standard deviations per sample at {fs:g} Hz, n = N*sqrt(2*rate) and w = K*sqrt(rate).",
        "The factor 2 is needed because the midpoint rule of VINS averages two independent noises per step.",
    )
    convert = {"N": lambda v: v * math.sqrt(2.0 * fs), "K": lambda v: v * math.sqrt(fs)}
    return value_lines(axes, ROWS, convert, convention, overbound=overbound)


TARGETS = (Target("vins", "VINS", "vins.yaml", render),)

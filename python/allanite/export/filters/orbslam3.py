"""ORB-SLAM3's settings: continuous-time N and K in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import rate_of
from allanite.export._lines import value_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]

ROWS = (
    ("IMU.NoiseGyro", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("IMU.NoiseAcc", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("IMU.GyroWalk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
    ("IMU.AccWalk", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N and K as they are: the program multiplies by √frequency, and divides by it, when it reads them."""
    fs = rate_of(axes, rate, "orbslam3")
    convention = (
        "ORB-SLAM3: continuous time, two-sided, deviations; it applies sqrt(IMU.Frequency) itself.",
    )
    same = {"N": float, "K": float}
    text = value_lines(axes, ROWS, same, convention, overbound=overbound)
    return text + f"IMU.Frequency: {fs:.6f}\n"

"""Diagonals of a ROS sensor_msgs/Imu message's covariances."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import header, needed, rate_of, split

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None) -> str:
    """Variance of the white noise of one sample, N² × rate, row-major 3 × 3.

    One axis serves all three; three axes take x, y, z in the order given.
    """
    fs = rate_of(axes, rate, "ros")
    lines = [
        header(axes, "#", "N"),
        f"# Variances of one sample at {fs:g} Hz: N^2 x rate, without slow noise.\n",
    ]
    for key, own, unit in zip(
        ("angular_velocity_covariance", "linear_acceleration_covariance"),
        split(axes),
        ("(rad/s)^2", "(m/s^2)^2"),
        strict=True,
    ):
        if not own:
            continue
        found = [needed(axis, "N", "ros")[0] ** 2 * fs for axis in own]
        x, y, z = found if len(found) == 3 else (max(found),) * 3
        lines.append(f"{key}: [{x:.6e}, 0, 0, 0, {y:.6e}, 0, 0, 0, {z:.6e}]  # {unit}\n")
    return "".join(lines)

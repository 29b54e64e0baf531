"""Kalibr's imu.yaml: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import header, rate_of, split, worst

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None) -> str:
    """Noise density is N and random walk is K, both as Kalibr's wiki "IMU Noise Model" says.

    There, sigma of a sample is N/sqrt(dt) and of a bias step K·sqrt(dt).
    """
    lines = [header(axes, "#", "NK")]
    update = rate_of(axes, rate, "kalibr")
    for sensor, own, density, walk in zip(
        ("accelerometer", "gyroscope"),
        reversed(split(axes)),
        ("m/s^2/sqrt(Hz)", "rad/s/sqrt(Hz)"),
        ("m/s^3/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
        strict=True,
    ):
        if not own:
            lines.append(f"# {sensor}: no model was given\n")
            continue
        for key, name, unit in (("noise_density", "N", density), ("random_walk", "K", walk)):
            value, remark = worst(own, name, "kalibr")
            note = f"{unit}, two-sided, continuous time" + (f"; {remark}" if remark else "")
            lines.append(f"{sensor}_{key}: {value:.6e}  # {note}\n")
    lines.append("rostopic: /imu0\n")
    lines.append(f"update_rate: {update:g}  # Hz\n")
    return "".join(lines)

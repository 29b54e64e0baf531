"""VINS-Mono / VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w, all per sample."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.export._axis import header, rate_of, split, worst

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None) -> str:
    """N·√rate and K·√rate.

    The estimator multiplies both by dt each step (integration_base.h: V·noise·Vᵀ, V ∝ dt), so n is
    the standard deviation of a sample, and a bias step w·dt = K·√dt gives w = K/√dt.
    """
    fs = rate_of(axes, rate, "vins")
    lines = [
        header(axes, "#", "NK"),
        f"# Per sample at {fs:g} Hz: n = N*sqrt(rate), w = K*sqrt(rate).\n",
    ]
    gyro, accel = split(axes)
    for own, key, name, unit in (
        (accel, "acc_n", "N", "m/s^2"),
        (gyro, "gyr_n", "N", "rad/s"),
        (accel, "acc_w", "K", "m/s^3"),
        (gyro, "gyr_w", "K", "rad/s^2"),
    ):
        if own:
            value, remark = worst(own, name, "vins")
            note = f"{unit}, standard deviation per sample" + (f"; {remark}" if remark else "")
            lines.append(f"{key}: {value * math.sqrt(fs):.6e}  # {note}\n")
    return "".join(lines)

"""DM-VIO: noise of its settings file, continuous-time deviations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._lines import needs_both, value_lines
from allanite.export._target import Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS"]

ROWS = (
    ("accelerometer_noise_density", "accel", "N", "m/s^2/sqrt(Hz), two-sided"),
    ("gyroscope_noise_density", "gyro", "N", "rad/s/sqrt(Hz), two-sided"),
    ("accelerometer_random_walk", "accel", "K", "m/s^3/sqrt(Hz), two-sided"),
    ("gyroscope_random_walk", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """N and K: GTSAM's preintegration squares N; the bias moves by K·√Δt between frames (IMUUtils.cpp, fcc306b)."""
    needs_both(axes, "dmvio")
    convention = (
        "DM-VIO: continuous time, two-sided, deviations; lines for the settings file.",
        "DM-VIO's own files have larger numbers: they also stand for vibration, which a log at rest does not show.",
    )
    lines = value_lines(axes, ROWS, {"N": float, "K": float}, convention, overbound=overbound)
    return lines + (
        "# The rule of integration adds nothing worth naming; DM-VIO's default would be 0.1 m^2/s.\n"
        "integration_sigma: 1.0e-08\n"
    )


TARGETS = (Target("dmvio", "DM-VIO", "dmvio.yaml", render),)

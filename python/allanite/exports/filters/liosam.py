"""LIO-SAM params.yaml: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

ROWS = (
    ("imuAccNoise", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("imuGyrNoise", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("imuAccBiasN", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
    ("imuGyrBiasN", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of lines ``key: value`` with N and K in SI, not converted; `rate` is not used.

    GTSAM's preintegration squares N. LIO-SAM multiplies K by √Δt, with the time Δt between key frames. Each number is
    the largest of the axes of its sensor.
    """
    convention = (
        "LIO-SAM (copy below lio_sam:): continuous-time, two-sided densities. LIO-SAM squares them itself.",
    )
    return value_lines(axes, ROWS, {}, convention, overbound=overbound)


TARGETS = (Target("liosam", "LIO-SAM", "liosam.yaml", render),)

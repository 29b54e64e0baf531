"""GTSAM: continuous-time covariances of PreintegrationCombinedParams, as Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import header, split, worst

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None) -> str:  # noqa: ARG001 - continuous time
    """Squares of N and K in SI: power spectral densities, not variances of samples."""
    gyro, accel = split(axes)
    lines = [
        header(axes, "#", "NK"),
        "# Continuous-time covariances: N^2 and K^2, independent of the sampling rate.\n",
        "import gtsam\nimport numpy as np\n\n",
        "parameters = gtsam.PreintegrationCombinedParams.MakeSharedU(9.80665)\n",
    ]
    for own, setter, name, unit in (
        (accel, "setAccelerometerCovariance", "N", "(m/s^2)^2/Hz"),
        (gyro, "setGyroscopeCovariance", "N", "(rad/s)^2/Hz"),
        (accel, "setBiasAccCovariance", "K", "(m/s^3)^2/Hz"),
        (gyro, "setBiasOmegaCovariance", "K", "(rad/s^2)^2/Hz"),
    ):
        if own:
            value, remark = worst(own, name, "gtsam")
            note = f"{unit}, two-sided" + (f"; {remark}" if remark else "")
            lines.append(f"parameters.{setter}({value:.6e}**2 * np.eye(3))  # {note}\n")
    return "".join(lines)

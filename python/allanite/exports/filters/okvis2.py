"""OKVIS2, section imu_parameters: continuous-time, two-sided N and K in SI."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._initial import initial_lines
from allanite.exports._lines import check_both_sensors, value_lines
from allanite.exports._target import Target

ROWS = (
    ("sigma_g_c", "gyro", "N", "rad/s/sqrt(Hz), two-sided, continuous time"),
    ("sigma_a_c", "accel", "N", "m/s^2/sqrt(Hz), two-sided, continuous time"),
    ("sigma_gw_c", "gyro", "K", "rad/s^2/sqrt(Hz), two-sided, continuous time"),
    ("sigma_aw_c", "accel", "K", "m/s^3/sqrt(Hz), two-sided, continuous time"),
)
#: Keys of the standard deviation of the prior on the first bias, rad/s and m/s^2.
INITIAL = {"gyro": "sigma_bg", "accel": "sigma_ba"}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of the YAML node ``imu_parameters`` with N and K in SI, not converted; `rate` is not used.

    OKVIS2 adds dt·sigma² in each step of length dt (okvis_ceres/src/ImuError.cpp, 0f18f34). Each number is the largest
    of the axes of its sensor. Raises `InputError` unless both sensors are given.
    """
    check_both_sensors(axes, "okvis2")
    convention = (
        "OKVIS2 (OKVIS): continuous-time, two-sided densities. Each step of length dt adds sigma^2*dt.",
        "Copy these lines into the node imu_parameters. Set a_max, g_max, g and T_BS yourself.",
    )
    form = "    {key}: {value:.6e}  {note}"
    numbers = value_lines(
        axes, ROWS, {}, convention, overbound=overbound, form=form, node="imu_parameters:\n"
    )
    return numbers + initial_lines(axes, INITIAL, form, "    #", overbound=overbound)


TARGETS = (Target("okvis2", "OKVIS2", "okvis2.yaml", render),)

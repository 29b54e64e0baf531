"""NaveGo: MATLAB code with the error fields of its IMU structure in SI, and a Gauss-Markov bias for each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.exports._axis import gyro_and_accel_axes
from allanite.exports._choice import TIME_NOTE, choose_lag
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.exports._axis import Axis


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a MATLAB script: N, and density, correlation time and standard deviation of the bias, as fields in SI units.

    ins_gnss.m squares arw, vrw, gb_psd and ab_psd for the continuous Q; F_update.m has -1/corr for the biases
    (017fd29). The lines must come after `imu_si_errors`, which computes gb_psd without the factor √2 of a Gauss-Markov
    process. Each of x, y and z has its own numbers. Raises `InputError` unless both sensors are given.
    """
    check_both_sensors(axes, "navego")
    convention = [
        "NaveGo: continuous-time, two-sided densities in SI. Put these lines after the call of imu_si_errors.",
        "gb and ab are Gauss-Markov biases with the correlation time T: 37 % of a bias is left after T.",
        TIME_NOTE,
    ]
    rows, pairs = [], []
    for own, white, bias, unit in zip(
        gyro_and_accel_axes(axes), ("arw", "vrw"), ("gb", "ab"), ("rad/s", "m/s^2"), strict=True
    ):
        chosen = [(axis, choose_lag(axis, overbound=overbound)) for axis in own]
        numbers = [(c.N, c.q_c, c.correlation_time, c.sigma) for _, c in chosen]
        places, axis_remarks = numbers_in_xyz([axis for axis, _ in chosen], numbers)
        convention += [f"{white}: {line}" for line in axis_remarks]
        pairs += chosen
        for key, place, what in (
            (white, 0, f"{unit}/sqrt(Hz)"),
            (f"{bias}_psd", 1, f"{unit}/s/sqrt(Hz), density of the noise that drives the bias"),
            (f"{bias}_corr", 2, "s, correlation time T of the bias"),
            (f"{bias}_dyn", 3, f"{unit}, standard deviation of the bias, used in P0"),
        ):
            values = " ".join(f"{one[place]:.6e}" for one in places)
            rows.append(f"imu.{key} = [{values}];  % {what}\n")
    return as_comments(head_comments(pairs, convention), "%") + "".join(rows)


TARGETS = (Target("navego", "NaveGo", "navego_imu.m", render),)

"""NaveGo: MATLAB code with the error fields of its IMU structure in SI, and a Gauss-Markov bias for each axis."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis
from allanite.exports._choice import TIME_NOTE, choose_gauss_markov
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import sensors_in_xyz

#: Keys of N and of the bias of each sensor, and its SI unit.
KEYS = {"gyroscope": ("arw", "gb", "rad/s"), "accelerometer": ("vrw", "ab", "m/s^2")}


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
    choose = partial(choose_gauss_markov, overbound=overbound)
    names = ("N", "q_c", "correlation_time", "sigma")
    for sensor, own, places, remarks in sensors_in_xyz(axes, KEYS, choose, names):
        pairs += own
        convention += remarks
        white, bias, unit = KEYS[sensor]
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

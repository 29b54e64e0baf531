"""KF-GINS and OB_GINS, section imunoise: data-sheet units, Gauss-Markov biases with one correlation time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from allanite.exports._axis import Axis
from allanite.exports._choice import TIME_NOTE, choose_gauss_markov
from allanite.exports._follow import shared_correlation_time
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import sensors_in_xyz

DEGREE = math.pi / 180.0
#: Keys of N and σ of each sensor, with the size of the unit in SI and its name.
ROWS = {
    "gyroscope": (("arw", DEGREE / 60, "deg/sqrt(hr)"), ("gbstd", DEGREE / 3600, "deg/hr")),
    "accelerometer": (("vrw", 1 / 60, "m/s/sqrt(hr)"), ("abstd", 1e-5, "mGal")),
}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of the YAML node ``imunoise``: N, and σ and correlation time of the Gauss-Markov biases.

    N is in °/√h and m/s/√h, σ in °/h and mGal. All axes have one correlation time, in h. With `overbound`, it is the
    geometric mean of those of the axes. Each of x, y and z has its own N and σ. `rate` is not used. Raises `InputError`
    unless both sensors are given.
    """
    check_both_sensors(axes, "kfgins")
    if overbound:
        # All axes get the geometric mean of their best correlation times.
        times = [choose_gauss_markov(axis, overbound=True).correlation_time for axis in axes]
        time = float(np.exp(np.mean(np.log(times))))
    else:
        time = shared_correlation_time(axes)
    convention = [
        "KF-GINS, OB_GINS: arw and vrw are continuous-time, two-sided densities. gbstd and abstd are the standard",
        "deviation sigma (not the density) of Gauss-Markov biases. corrtime is their correlation time T: 37 % of a bias is",
        "left after T. Set the scale factors gsstd and asstd yourself.",
        TIME_NOTE,
    ]
    pairs, lines = [], {}
    choose = partial(choose_gauss_markov, time=time, overbound=overbound)
    for sensor, own, places, remarks in sensors_in_xyz(axes, ROWS, choose, ("N", "sigma")):
        pairs += own
        convention += remarks
        for (key, unit, spelled), values in zip(
            ROWS[sensor], zip(*places, strict=True), strict=True
        ):
            numbers = ", ".join(f"{value / unit:.6e}" for value in values)
            lines[key] = f"  {key}: [{numbers}]  # {spelled}\n"
    return as_comments(head_comments(pairs, convention)) + (
        "imunoise:\n"
        f"{lines['arw']}{lines['vrw']}{lines['gbstd']}{lines['abstd']}"
        "  gsstd: [0.0, 0.0, 0.0]  # ppm\n"
        "  asstd: [0.0, 0.0, 0.0]  # ppm\n"
        f"  corrtime: {time / 3600:.6e}  # hr\n"
    )


TARGETS = (Target("kfgins", "KF-GINS", "kf-gins.yaml", render),)

"""PSINS: MATLAB code with the call of imuerrset in data-sheet units, and a Gauss-Markov bias for each axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis
from allanite.exports._choice import TIME_NOTE, choose_gauss_markov
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import sensors_in_xyz

DEGREE, UG = math.pi / 180.0, 1e-6 * 9.7803267714
#: Gyroscope and accelerometer: arguments of imuerrset for N, σ and correlation time, each with its unit in SI and as text.
ROWS = {
    "gyroscope": (("web", DEGREE / 60.0, "deg/sqrt(h)"), ("sqrtR0G", DEGREE / 3600.0, "deg/h"), ("TauG", 1.0, "s")),
    "accelerometer": (("wdb", UG, "ug/sqrt(Hz)"), ("sqrtR0A", UG, "ug"), ("TauA", 1.0, "s")),
}  # fmt: skip


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a MATLAB script: N in °/√h and µg/√Hz, σ of the Gauss-Markov bias in °/h and µg, and its correlation time.

    `imuerrset` of PSINS uses these units. Each of x, y and z has its own numbers. Raises `InputError` unless both
    sensors are given.
    """
    check_both_sensors(axes, "psins")
    pairs = []
    convention = [
        "PSINS: web and wdb are continuous-time, two-sided densities. sqrtR0G and sqrtR0A are sigma of Gauss-Markov",
        "biases, TauG and TauA their correlation times T: 37 % of a bias is left after T. g is glv.g0 of PSINS, 9.7803",
        "m/s^2. Set the constant biases eb and db yourself.",
        TIME_NOTE,
    ]
    lines = []
    choose = partial(choose_gauss_markov, overbound=overbound)
    names = ("N", "sigma", "correlation_time")
    for sensor, own, places, remarks in sensors_in_xyz(axes, ROWS, choose, names):
        pairs += own
        convention += remarks
        for number, (key, unit, spelled) in enumerate(ROWS[sensor]):
            values = "; ".join(f"{place[number] / unit:.6e}" for place in places)
            lines.append(f"{key} = [{values}];  % {spelled}\n")
    return as_comments(head_comments(pairs, convention), "%") + (
        "eb = zeros(3,1);  % deg/h\ndb = zeros(3,1);  % ug\n"
        + "".join(lines)
        + "imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);\n"
    )


TARGETS = (Target("psins", "PSINS", "psins_imuerr.m", render),)

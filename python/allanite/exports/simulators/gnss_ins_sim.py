"""gnss-ins-sim: Python code with the dictionary of IMU errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis
from allanite.exports._choice import choose_gauss_markov
from allanite.exports._head import head_comments
from allanite.exports._held import NoiseParameters
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import triads_of

DEGREE = math.pi / 180.0
ROWS = {
    "gyro": (("arw", "N", DEGREE / 60, "deg/rt-hr"), ("b_stability", "sigma", DEGREE / 3600, "deg/hr")),
    "accel": (("vrw", "N", 1 / 60, "m/s/rt-hr"), ("b_stability", "sigma", 1.0, "m/s2")),
}  # fmt: skip


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a Python file: N in °/√h and m/s/√h; σ and correlation time of the Gauss-Markov bias, which starts at 0."""
    convention = [
        "gnss-ins-sim: continuous-time, two-sided densities. b_stability is sigma of a Gauss-Markov bias, b_corr is its",
        "correlation time.",
    ]
    lines = []
    choose = partial(choose_gauss_markov, overbound=overbound, simulator=True)
    names = ("N", "q_c", "correlation_time")
    found = triads_of(axes, ROWS, choose, names)
    for sensor, places in found.numbers.items():
        held = [
            NoiseParameters(N, 0.0, q_c, time)
            for N, q_c, time in zip(*places.values(), strict=True)
        ]
        lines.append(f'    "{sensor}_b": np.zeros(3),\n')
        for key, name, unit, spelled in (*ROWS[sensor], ("b_corr", "correlation_time", 1.0, "s")):
            values = ", ".join(f"{getattr(c, name) / unit:.6e}" for c in held)
            lines.append(f'    "{sensor}_{key}": np.array([{values}]),  # {spelled}\n')
    notes = head_comments(found.pairs, [*convention, *found.remarks], simulator=True)
    return as_comments(notes) + "import numpy as np\n\nimu_err = {\n" + "".join(lines) + "}\n"


TARGETS = (Target("gnss-ins-sim", "gnss-ins-sim", "gnss-ins-sim.py", render, whole_record=True),)

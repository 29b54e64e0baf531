"""KF-GINS and OB_GINS, section imunoise: data-sheet units, Gauss-Markov biases with one correlation time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from allanite.exports._axis import gyro_and_accel_axes
from allanite.exports._choice import TIME_NOTE, choose_lag
from allanite.exports._follow import shared_correlation_time
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.exports._axis import Axis

DEGREE = math.pi / 180.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of the YAML node ``imunoise``: N, and σ and correlation time of the Gauss-Markov biases.

    N is in °/√h and m/s/√h, σ in °/h and mGal. All axes have one correlation time, in h. Each of x, y and z has its own
    numbers. `rate` is not used. Raises `InputError` unless both sensors are given.
    """
    gyro, accel = gyro_and_accel_axes(axes)
    check_both_sensors(axes, "kfgins")
    axes = [*gyro, *accel]
    if overbound:
        # All axes get the geometric mean of their best correlation times.
        own = [choose_lag(axis, overbound=True).correlation_time for axis in axes]
        time = float(np.exp(np.mean(np.log(own))))
    else:
        time = shared_correlation_time(axes)
    choose_all = [(axis, choose_lag(axis, time, overbound=overbound)) for axis in axes]
    convention = [
        "KF-GINS, OB_GINS: arw and vrw are continuous-time, two-sided densities. gbstd and abstd are the standard",
        "deviation sigma (not the density) of Gauss-Markov biases. corrtime is their correlation time T: 37 % of a bias is",
        "left after T. Set the scale factors gsstd and asstd yourself.",
        TIME_NOTE,
    ]
    rows = []
    for sensor, pairs in (
        ("gyroscope", choose_all[: len(gyro)]),
        ("accelerometer", choose_all[len(gyro) :]),
    ):
        places, axis_remarks = numbers_in_xyz(
            [a for a, _ in pairs], [(c.N, c.sigma) for _, c in pairs]
        )
        convention += [f"{sensor} {line}" for line in axis_remarks]
        rows.append(places)

    def row(places: list[tuple[float, ...]], number: int, unit: float) -> str:
        """Text ``[x, y, z]`` of the number at index `number` of each axis, divided by `unit`."""
        return "[" + ", ".join(f"{place[number] / unit:.6e}" for place in places) + "]"

    return as_comments(head_comments(choose_all, convention)) + (
        "imunoise:\n"
        f"  arw: {row(rows[0], 0, DEGREE / 60)}  # deg/sqrt(hr)\n"
        f"  vrw: {row(rows[1], 0, 1 / 60)}  # m/s/sqrt(hr)\n"
        f"  gbstd: {row(rows[0], 1, DEGREE / 3600)}  # deg/hr\n"
        f"  abstd: {row(rows[1], 1, 1e-5)}  # mGal\n"
        "  gsstd: [0.0, 0.0, 0.0]  # ppm\n"
        "  asstd: [0.0, 0.0, 0.0]  # ppm\n"
        f"  corrtime: {time / 3600:.6e}  # hr\n"
    )


TARGETS = (Target("kfgins", "KF-GINS", "kf-gins.yaml", render),)

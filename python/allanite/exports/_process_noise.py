"""Process noise of filters that have angle and velocity states but no bias states."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._choice import choose
from allanite.exports._follow import negligible_walk
from allanite.exports._held import NoiseParameters
from allanite.exports._triad import numbers_in_xyz

#: Order of the states of robot_localization and of the three-dimensional models of fuse.
STATES = (
    *("x", "y", "z", "roll", "pitch", "yaw"),
    *("vx", "vy", "vz", "vroll", "vpitch", "vyaw"),
    *("ax", "ay", "az"),
)
#: States whose process noise follows from a gyroscope and from an accelerometer.
ANGLES, VELOCITIES = STATES[3:6], STATES[6:9]
CONVENTION = (
    "The filter has no bias state. This file assumes that the bias is removed at the beginning. White noise of the angle",
    "(gyroscope) and of the velocity (accelerometer) replaces the later random walk of the bias: K^2*horizon^2/3 per",
    "second. This variance is right at the horizon and too large before. The axes of the sensor must be those of the",
    "vehicle. The white noise of the sensor belongs into the covariance of its messages (format ros).",
)


@dataclass(frozen=True, slots=True)
class ProcessNoise:
    """Process noise that slow sensor noise needs.

    Attributes
    ----------
    variances : dict of str to float
        Variance per second by state: of angles in rad²/s, of velocities in m²/s³.
    pairs : list of (Axis, NoiseParameters)
        Each axis with white noise of the same variance, for the head of the file.
    remarks : list of str
        Remarks on axes without a model.
    """

    variances: dict[str, float]
    pairs: list[tuple[Axis, NoiseParameters]]
    remarks: list[str]


def process_noise(axes: Sequence[Axis], *, overbound: bool) -> ProcessNoise:
    """`ProcessNoise` of angles (gyroscopes) and velocities (accelerometers): variances per second for x, y and z.

    The variance per second is K²·horizon²/3: white noise with the error that a random walk K gives at the horizon. N is
    only stated in the head of the file. A sensor without axes has no variances.
    """
    variances: dict[str, float] = {}
    pairs, remarks = [], []
    for sensor, states, own in zip(
        ("gyro", "accel"), (ANGLES, VELOCITIES), gyro_and_accel_axes(axes), strict=True
    ):
        if not own:
            continue
        found = []
        for axis in own:
            choice = choose(axis, overbound=overbound)
            walk = choice.K**2 * axis.horizon**2 / 3.0
            found.append((walk,))
            white = math.sqrt(choice.N**2 + walk)
            pairs.append(
                (
                    axis,
                    replace(choice, N=white, K=negligible_walk(white, axis.horizon, axis.sampling)),
                )
            )
        numbers, axis_remarks = numbers_in_xyz(own, found)
        variances |= {state: value for state, (value,) in zip(states, numbers, strict=True)}
        remarks += [f"{sensor} {line}" for line in axis_remarks]
    return ProcessNoise(variances, pairs, remarks)

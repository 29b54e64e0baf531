"""MATLAB insEKF: process noise of the bias states, and measurement noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis, gyro_and_accel_axes, rate_of
from allanite.exports._choice import choose
from allanite.exports._head import head_comments
from allanite.exports._initial import largest_initial_bias, unknown_bias_text
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import triads_of

UNITS = {"Gyroscope": "rad/s", "Accelerometer": "m/s^2"}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a MATLAB script: K² as process noise of the bias states, N²·rate as measurement noise, for x, y and z.

    A prediction of insEKF over dt adds dt·AdditiveProcessNoise. The measurement noise is the variance of a sample.
    Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "insekf")
    convention = [
        "insEKF: AdditiveProcessNoise is a continuous-time density, K^2 for a bias. A prediction over dt adds dt times",
        f"this density. Measurement noise is the variance of a sample at {fs:g} Hz, N^2*rate. Orientation, velocity and",
        "other states of motion keep the process noise of your filter.",
    ]
    body, members = [], {}
    found = triads_of(axes, UNITS, partial(choose, overbound=overbound), ("N", "K"))
    sensors = [own for own in gyro_and_accel_axes(axes) if own]
    for (name, numbers), own in zip(found.numbers.items(), sensors, strict=True):
        unit = UNITS[name]
        member = members[name] = name.lower()
        bias = f"states.{name}_Bias"
        white = " ".join(f"{N * math.sqrt(fs):.6e}" for N in numbers["N"])
        walk = " ".join(f"{K:.6e}" for K in numbers["K"])
        body += [
            f"% {name}: K in ({unit})/s^0.5, then N*sqrt(rate) in {unit}.\n",
            f"Q({bias}, {bias}) = diag([{walk}].^2);\n",
            f"{member}Noise = diag([{white}].^2);  % fuse(filter, {member}, reading, {member}Noise)\n",
        ]
        largest = largest_initial_bias(own, overbound=overbound)
        if largest is not None:
            body.append(
                f"statecovparts(filter, '{name}_Bias', {largest[0]:.6e}^2);"
                "  % standard deviation at switch-on, largest of the axes\n"
            )
        else:
            body.append(as_comments([unknown_bias_text(own[0])], "%"))
    made = "".join(f"{member} = ins{name};\n" for name, member in members.items())
    lines = as_comments(head_comments(found.pairs, [*convention, *found.remarks]), "%")
    return (
        f"{lines}{made}filter = insEKF({', '.join(members.values())}, insMotionPose);\nstates = stateinfo(filter);\n"
        f"Q = filter.AdditiveProcessNoise;\n{''.join(body)}filter.AdditiveProcessNoise = Q;\n"
    )


TARGETS = (Target("insekf", "MATLAB insEKF", "insekf.m", render),)

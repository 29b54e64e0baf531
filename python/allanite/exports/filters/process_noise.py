"""Process noise of filters that have angle and velocity states but no bias states: fuse and robot_localization."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._choice import choose
from allanite.exports._follow import negligible_walk
from allanite.exports._head import head_comments
from allanite.exports._held import NoiseParameters
from allanite.exports._initial import largest_initial_bias, unknown_bias_text
from allanite.exports._target import Target
from allanite.exports._text import as_comments
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
#: Motion models of fuse and the order of their states (fuse_models/src, dae8521 and 24ee705).
MODELS = {
    "unicycle_2d": ("x", "y", "yaw", "vx", "vy", "vyaw", "ax", "ay"),
    "omnidirectional_3d": STATES,
}
#: Process noise of the other states, which describe the motion of the vehicle: the value in the tutorials of fuse.
MOTION = 0.1
#: Default process noise of robot_localization (src/filter_base.cpp, 1cb9533), kept for the states that describe the
#: motion of the vehicle.
DEFAULTS = dict(
    zip(
        STATES,
        (0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015),
        strict=True,
    )
)  # fmt: skip
#: Its default initial variance of a state.
INITIAL = 1e-9
#: States whose initial error is the bias at switch-on.
RATES = {"gyro": STATES[9:12], "accel": STATES[12:15]}


def _process_noise(
    axes: Sequence[Axis], *, overbound: bool
) -> tuple[dict[str, float], list[tuple[Axis, NoiseParameters]], list[str]]:
    """Tuple (variances, pairs, remarks): process noise that slow sensor noise needs.

    `variances` maps each state to its variance per second: angles in rad²/s, velocities in m²/s³. The variance is
    K²·T²/3, where T is the horizon: white noise whose integral has, after T, the same variance as that of a random walk
    K. `pairs` holds each axis with this variance added to its own white noise and with a negligible K, for the head of
    the file.
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
            N = math.sqrt(choice.N**2 + walk)
            K = negligible_walk(N, axis.horizon, axis.sampling)
            pairs.append((axis, replace(choice, N=N, K=K)))
        numbers, axis_remarks = numbers_in_xyz(own, found)
        variances |= {state: value for state, (value,) in zip(states, numbers, strict=True)}
        remarks += [f"{sensor} {line}" for line in axis_remarks]
    return variances, pairs, remarks


def fuse(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a YAML file with ``process_noise_diagonal`` of two motion models; `rate` is not used.

    The covariance of a step of length dt is dt times the diagonal. States that the sensors do not determine get 0.1.
    """
    variances, pairs, remarks = _process_noise(axes, overbound=overbound)
    convention = (
        "fuse: variances per second (continuous time). The covariance between two states is dt times the diagonal.",
        "Copy the lines of your motion model. With scale_process_noise, the noise of the pose is multiplied by the speed.",
        *CONVENTION,
        *remarks,
    )
    lines = [as_comments(head_comments(pairs, convention, samples=True))]
    for name, states in MODELS.items():
        others = ", ".join(state for state in states if state not in variances)
        numbers = ", ".join(f"{variances.get(state, MOTION):.6e}" for state in states)
        lines += [
            f"{name}:\n",
            f"  # {', '.join(states)}\n",
            f"  # Values of the fuse tutorials; adapt them to the motion of your vehicle: {others}.\n",
            f"  process_noise_diagonal: [{numbers}]\n",
        ]
    return "".join(lines)


def robot_localization(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a YAML file with the diagonal matrices process_noise_covariance and initial_estimate_covariance.

    A prediction over dt adds dt times the process noise (src/ekf.cpp, 1cb9533). States of no sensor get the defaults.
    The initial covariance is only written if the bias at switch-on is known.
    """
    variances, pairs, remarks = _process_noise(axes, overbound=overbound)
    convention = (
        "robot_localization: variances per second (continuous time). A prediction over dt adds dt times the matrix.",
        *CONVENTION,
        *remarks,
    )
    lines = [as_comments(head_comments(pairs, convention, samples=True))]
    lines.append("ekf_filter_node:\n  ros__parameters:\n")
    values = DEFAULTS | variances
    others = ", ".join(state for state in STATES if state not in variances)
    lines.append(
        f"    # Defaults of robot_localization; adapt them to the motion of your vehicle: {others}.\n"
    )
    lines.append(f"    process_noise_covariance: {_diagonal_matrix_text(values)}\n")
    initial = dict.fromkeys(STATES, INITIAL)
    known: list[str] = []
    for (sensor, states), own in zip(RATES.items(), gyro_and_accel_axes(axes), strict=True):
        largest = largest_initial_bias(own, overbound=overbound)
        if largest is not None:
            initial |= dict.fromkeys(states, largest[0] ** 2)
            known.append(sensor)
        elif own:
            lines.append(as_comments([unknown_bias_text(own[0])], "    #"))
    if known:
        lines.append(
            f"    # Initial variance for {', '.join(known)}: variance of the bias at switch-on, largest of the axes.\n"
            f"    initial_estimate_covariance: {_diagonal_matrix_text(initial)}\n"
        )
    return "".join(lines)


def _diagonal_matrix_text(values: dict[str, float]) -> str:
    """Text of a full 15 × 15 matrix, row by row: older versions of robot_localization do not accept the diagonal alone."""
    rows = [", ".join(f"{values[a]:.6e}" if a == b else "0.0" for b in STATES) for a in STATES]
    return "[" + (",\n" + 8 * " ").join(rows) + "]"


TARGETS = (
    Target("fuse", "fuse", "fuse.yaml", fuse),
    Target(
        "robot_localization", "robot_localization", "robot_localization.yaml", robot_localization
    ),
)

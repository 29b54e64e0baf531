"""robot_localization: process noise and initial covariance of ekf_node and ukf_node."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._head import head_comments
from allanite.exports._initial import largest_initial_bias, unknown_bias_text
from allanite.exports._process_noise import CONVENTION, STATES, process_noise
from allanite.exports._target import Target
from allanite.exports._text import as_comments

#: Default process noise (src/filter_base.cpp, 1cb9533), kept for the states that describe the motion of the vehicle.
DEFAULTS = dict(
    zip(
        STATES,
        (0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015),
        strict=True,
    )
)  # fmt: skip
#: Default initial variance of a state.
INITIAL = 1e-9
#: States whose initial error is the bias at switch-on.
RATES = {"gyro": STATES[9:12], "accel": STATES[12:15]}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a YAML file with the diagonal matrices process_noise_covariance and initial_estimate_covariance.

    A prediction over dt adds dt times the process noise (src/ekf.cpp, 1cb9533). States of no sensor get the defaults.
    The initial covariance is only written if the bias at switch-on is known, with the largest of the axes.
    """
    noise = process_noise(axes, overbound=overbound)
    convention = (
        "robot_localization: variances per second (continuous time). A prediction over dt adds dt times the matrix.",
        *CONVENTION,
        *noise.remarks,
    )
    lines = [as_comments(head_comments(noise.pairs, convention, samples=True))]
    lines.append("ekf_filter_node:\n  ros__parameters:\n")
    values = DEFAULTS | noise.variances
    others = ", ".join(state for state in STATES if state not in noise.variances)
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
    """Text of a full 15 × 15 matrix, row by row: `values` on its diagonal, 0 elsewhere.

    `values` has one number for each of the 15 states of robot_localization. Older versions of this program do not accept
    the diagonal alone.
    """
    rows = [", ".join(f"{values[a]:.6e}" if a == b else "0.0" for b in STATES) for a in STATES]
    return "[" + (",\n" + 8 * " ").join(rows) + "]"


TARGETS = (Target("robot_localization", "robot_localization", "robot_localization.yaml", render),)

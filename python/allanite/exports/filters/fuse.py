"""fuse: process noise of the motion models in fuse_models."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._head import head_comments
from allanite.exports._process_noise import CONVENTION, STATES, process_noise
from allanite.exports._target import Target
from allanite.exports._text import as_comments

#: Motion models and the order of their states (fuse_models/src, dae8521 and 24ee705).
MODELS = {
    "unicycle_2d": ("x", "y", "yaw", "vx", "vy", "vyaw", "ax", "ay"),
    "omnidirectional_3d": STATES,
}
#: Process noise of the other states, which describe the motion of the vehicle: the value in the tutorials of fuse.
MOTION = 0.1


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a YAML file with ``process_noise_diagonal`` of two motion models; `rate` is not used.

    The diagonal holds variances per second, and 0.1 for the states that the sensors do not determine. The covariance of
    a step of length dt is dt times the diagonal.
    """
    noise = process_noise(axes, overbound=overbound)
    convention = (
        "fuse: variances per second (continuous time). The covariance between two states is dt times the diagonal.",
        "Copy the lines of your motion model. With scale_process_noise, the noise of the pose is multiplied by the speed.",
        *CONVENTION,
        *noise.remarks,
    )
    lines = [as_comments(head_comments(noise.pairs, convention, samples=True))]
    for name, states in MODELS.items():
        others = ", ".join(state for state in states if state not in noise.variances)
        numbers = ", ".join(f"{noise.variances.get(state, MOTION):.6e}" for state in states)
        lines += [
            f"{name}:\n",
            f"  # {', '.join(states)}\n",
            f"  # Values of the fuse tutorials; adapt them to the motion of your vehicle: {others}.\n",
            f"  process_noise_diagonal: [{numbers}]\n",
        ]
    return "".join(lines)


TARGETS = (Target("fuse", "fuse", "fuse.yaml", render),)

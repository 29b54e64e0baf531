"""Isaac Lab: Python code with the noise of observations: white noise, and a bias that is drawn once per episode."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes, rate_of
from allanite.exports._choice import choose_gauss_markov
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import as_comments


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a Python file: N·√rate for a sample, and σ of the Gauss-Markov process for the bias; largest of the axes.

    The simulator draws the bias at each reset (noise_model.py, 046b71b). A sensor without axes is left out. Raises
    `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "isaaclab")
    pairs = []
    convention = [
        f"Isaac Lab: std is the standard deviation per sample (observation) at {fs:g} Hz, N*sqrt(rate).",
        "The bias is drawn at each reset and stays constant in an episode. Each number is the largest of the axes.",
    ]
    lines = []
    for own, name in zip(gyro_and_accel_axes(axes), ("imu_ang_vel", "imu_lin_acc"), strict=True):
        if not own:
            continue
        held = [(a, choose_gauss_markov(a, overbound=overbound, simulator=True)) for a in own]
        pairs += held
        white = max(c.N for _, c in held) * math.sqrt(fs)
        bias = max(c.sigma for _, c in held)
        lines.append(
            f"{name}_noise = NoiseModelWithAdditiveBiasCfg(\n"
            f'    noise_cfg=GaussianNoiseCfg(mean=0.0, std={white:.6e}, operation="add"),\n'
            f'    bias_noise_cfg=GaussianNoiseCfg(mean=0.0, std={bias:.6e}, operation="abs"),\n)\n'
        )
    return as_comments(head_comments(pairs, convention, simulator=True)) + (
        "from isaaclab.utils.noise import GaussianNoiseCfg, NoiseModelWithAdditiveBiasCfg\n\n"
        + "".join(lines)
    )


TARGETS = (Target("isaaclab", "Isaac Lab", "isaaclab_noise.py", render, whole_record=True),)

"""Isaac Lab: noise of observations, as Python; white noise, and a bias drawn once an episode."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.export._axis import rate_of, split
from allanite.export._choice import choose_lag
from allanite.export._head import head
from allanite.export._target import Target
from allanite.export._text import comments

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS"]


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N·√rate of a sample; σ of the slow noise of a bias that is drawn at each reset (noise_model.py, 046b71b)."""
    fs = rate_of(axes, rate, "isaaclab")
    pairs = []
    convention = [
        f"Isaac Lab: std is a deviation per sample at {fs:g} Hz, N*sqrt(rate): the rate of the observation.",
        "The bias is drawn at each reset and stays through the episode; the largest numbers of the axes.",
    ]
    lines = []
    for own, name in zip(split(axes), ("imu_ang_vel", "imu_lin_acc"), strict=True):
        if not own:
            continue
        held = [(a, choose_lag(a, overbound=overbound, simulator=True)) for a in own]
        pairs += held
        white = max(c.N for _, c in held) * math.sqrt(fs)
        bias = max(c.sigma for _, c in held)
        lines.append(
            f"{name}_noise = NoiseModelWithAdditiveBiasCfg(\n"
            f'    noise_cfg=GaussianNoiseCfg(mean=0.0, std={white:.6e}, operation="add"),\n'
            f'    bias_noise_cfg=GaussianNoiseCfg(mean=0.0, std={bias:.6e}, operation="abs"),\n)\n'
        )
    return comments(head(pairs, convention, simulator=True)) + (
        "from isaaclab.utils.noise import GaussianNoiseCfg, NoiseModelWithAdditiveBiasCfg\n\n"
        + "".join(lines)
    )


TARGETS = (Target("isaaclab", "Isaac Lab", "isaaclab_noise.py", render, whole_record=True),)

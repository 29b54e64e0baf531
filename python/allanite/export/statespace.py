"""State space of the whole model: F, Q, H, R, P0 of each axis as JSON, in SI."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.export._axis import rate_of
from allanite.statespace import state_space

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]

STATES = 8


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """``allanite/state_spaces/1``: at most eight states an axis, and what the reduction costs."""
    fs = rate_of(axes, rate, "statespace")
    out = []
    for axis in axes:
        model = axis.limits if overbound else axis.model
        space = state_space(model, fs, states=STATES, duration=10.0 * axis.until)
        document = space.to_dict()
        for name in ("Q", "R", "P0"):
            document[name] = (axis.scale**2 * np.array(document[name])).tolist()
        about = {"name": axis.name, "unit": axis.unit, "source": axis.source}
        out.append({**about, "warning": axis.warning or None, **document})
    whole = {"schema": "allanite/state_spaces/1", "version": _kernels.version(), "axes": out}
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"

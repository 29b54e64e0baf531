"""JSON with the state space of the whole model of each axis: F, Q, H, R, P0, in SI units."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.effects import Model
from allanite.exports._axis import Axis, rate_of
from allanite.exports._initial import initial_bias
from allanite.exports._target import Target
from allanite.statespace import StateSpace, state_space

#: Maximum number of states per axis, if that many are enough. Chosen by judgment; not measured.
STATES = 8


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """JSON text ``allanite/state_spaces/1`` with the state space of each axis, and the error of its reduction.

    A state space has at most 8 states if that is possible. The coefficient of a random process that was not detected is
    0.64 of its 95 % limit. With `overbound`, every random process has its upper limit. Raises `InputError` if `rate` is
    None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "statespace")
    out = []
    for axis in axes:
        model = axis.limits if overbound else axis.expected
        space = _reduced_state_space(model, fs, 10.0 * axis.until)
        document = space.to_dict()
        for name in ("Q", "R", "P0"):
            document[name] = (axis.scale**2 * np.array(document[name])).tolist()
        about = {"name": axis.name, "unit": axis.unit, **axis.origin()}
        initial = initial_bias(axis, overbound=overbound)
        document["turn_on_variance"] = None if initial is None else initial**2
        kinds = document["known"]
        document["functions"] = [e for e in axis.fitted.entries if e["kind"] in kinds]
        mean = axis.fitted.mean
        document["offset"] = None if mean is None else mean * axis.scale / axis.inflate
        document["references"] = dict(axis.fitted.references)
        document["functions_unit_si"] = axis.scale / axis.inflate
        out.append({**about, **document})
    whole = {"schema": "allanite/state_spaces/1", "version": _kernels.version(), "axes": out}
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _reduced_state_space(model: Model, rate: float, duration: float) -> StateSpace:
    """`StateSpace` with at most 8 states if the model can be reduced, otherwise with all its states. `duration` is in s."""
    try:
        return state_space(model, rate, states=STATES, duration=duration)
    except InputError:
        return state_space(model, rate, duration=duration)


TARGETS = (
    Target(
        "statespace",
        "State space (JSON)",
        "state-space.json",
        render,
        any_sensor=True,
        whole_record=True,
    ),
)

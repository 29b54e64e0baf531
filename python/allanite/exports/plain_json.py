"""JSON with coefficients, units and intervals in SI, for your own programs."""

from __future__ import annotations

import json
from collections.abc import Sequence

from allanite import _kernels
from allanite.exports._axis import Axis
from allanite.exports._choice import choose
from allanite.exports._target import Target


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """JSON text ``allanite/parameters/1`` with the N, B, K, … of each axis (two-sided densities), and all its effects."""
    document = {
        "schema": "allanite/parameters/1",
        "version": _kernels.version(),
        "axes": [_axis_document(axis, rate, overbound=overbound) for axis in axes],
    }
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _axis_document(axis: Axis, rate: float | None, *, overbound: bool) -> dict[str, object]:
    """Dict for JSON of one axis; with `overbound`, also an N and K that cover the upper limits of the model."""
    out: dict[str, object] = {
        "name": axis.name,
        "kind": axis.kind,
        "unit": axis.unit,
        "rate_hz": rate or axis.rate,
        **axis.origin(),
        "density": "two-sided",
        "coefficients": {n: e.to_dict() for n, e in axis.coefficients.items()},
        "left_out": [
            e.kind
            for e in axis.model.effects
            if len(e.parameters) > 1 or e.parameters[0].name not in axis.coefficients
        ],
        "effects": axis.fitted.entries,
        "effects_unit_si": axis.scale,
    }
    if overbound:
        choice = choose(axis, overbound=True)
        out["overbound"] = {"N": choice.N, "K": choice.K, "until_s": axis.until}
    return out


TARGETS = (Target("json", "JSON", "parameters.json", render, any_sensor=True, alternatives=True),)

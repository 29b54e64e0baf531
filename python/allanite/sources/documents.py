"""Model documents (``allanite/fit/1``), which all sources return, with the assumptions that were made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.common.units import coefficient_unit
from allanite.effects import CATALOG

#: Allan deviation of flicker noise divided by its coefficient B, 0.664 (IEEE 952: sqrt(2 ln 2 / pi)).
PLATEAU = math.sqrt(2.0 * math.log(2.0) / math.pi)


def model_document(
    axis: str,
    unit: str,
    values: Mapping[str, float],
    source: str,
    rate: object = None,
    assumptions: Sequence[str] = (),
    intervals: Mapping[str, tuple[float, float]] | None = None,
) -> dict[str, Any]:
    """Model document (``allanite/fit/1``) of one axis with its coefficients Q, N, B, K, R; other names are ignored.

    `values` are in their canonical units for samples in `unit`; `source` is the file or text of the values. A `rate`, Hz,
    that is not a positive number means unknown. `assumptions` are sentences that exported filter files repeat. `intervals`
    are those of 95 %; a lower end of 0 means not detected.
    """
    effects = []
    for effect in CATALOG:
        parameter = next((p for p in effect.parameters if p.name == effect.short), None)
        if parameter is None or parameter.name not in values:
            continue
        assert not isinstance(parameter.unit, str)
        name = parameter.name
        given: dict[str, Any] = {
            "value": values[name],
            "unit": coefficient_unit(unit, parameter.unit),
        }
        if intervals is not None:
            given["interval"] = list(intervals[name])
            given["detected"] = intervals[name][0] > 0.0
        effects.append({"kind": effect.kind, "parameters": {name: given}})
    known = isinstance(rate, (int, float)) and 0.0 < rate < math.inf
    return {
        "schema": "allanite/fit/1",
        "effects": effects,
        "recording": {
            "column": axis,
            "path": source,
            "unit": unit,
            "rate_hz": float(rate) if known else None,  # type: ignore[arg-type]
        },
        "assumptions": list(assumptions),
    }

"""JSON in SI, with units and intervals: for programs of one's own."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from allanite import _kernels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None) -> str:
    """``allanite/parameters/1``: coefficients of each axis; N is two-sided, as its name says."""
    document = {
        "schema": "allanite/parameters/1",
        "version": _kernels.version(),
        "axes": [
            {
                "name": axis.name,
                "kind": axis.kind,
                "unit": axis.unit,
                "rate_hz": rate or axis.rate,
                "source": axis.source,
                "density": "two-sided",
                "coefficients": {n: e.to_dict() for n, e in axis.coefficients.items()},
                "left_out": list(axis.others),
            }
            for axis in axes
        ],
    }
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"

"""Residuals over averaging time: the range in which the measured Allan curve differs most from the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import run_at
from allanite.fit.curve import MIN_FAILING_SCORE

if TYPE_CHECKING:
    from allanite.fit.curve import Curve


def rows(curve: Curve) -> list[dict[str, Any]]:
    """List of dicts, one per averaging time: measured and model deviation, their ratio, standard normal score z."""
    return [
        {
            "tau_s": float(t),
            "measured": float(a),
            "model": float(b),
            "ratio": float(a / b),
            "z": float(z),
        }
        for t, a, b, z in zip(curve.tau, curve.measured, curve.model, curve.z, strict=True)
    ]


def worst(curve: Curve) -> tuple[float, float] | None:
    """Pair (low, high), s: the range of τ in which the fit fails most; None if no |z| reaches `MIN_FAILING_SCORE`.

    It is the range around the largest |z| in which z stays above 2 (or below −2). A z that is not finite counts as 0.
    """
    z = np.where(np.isfinite(curve.z), curve.z, 0.0)
    top = int(np.argmax(np.abs(z)))
    if abs(z[top]) < MIN_FAILING_SCORE:
        return None
    low, high = run_at(z * np.sign(z[top]) > 2.0, top)
    return float(curve.tau[low]), float(curve.tau[high])

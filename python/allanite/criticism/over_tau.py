"""Residuals over averaging time: the range in which the measured Allan curve differs most from the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import run_at
from allanite.common.documents import rows_of
from allanite.fit.curve import MIN_FAILING_SCORE

if TYPE_CHECKING:
    from allanite.fit.curve import Curve


def rows(curve: Curve) -> list[dict[str, Any]]:
    """List of dicts, one per averaging time: measured and model deviation, their ratio, standard normal score z."""
    ratio = curve.measured / curve.model
    return rows_of(
        tau_s=curve.tau, measured=curve.measured, model=curve.model, ratio=ratio, z=curve.z
    )


def worst(curve: Curve) -> tuple[float, float] | None:
    """Pair (shortest, longest) of the averaging times, s, around the worst misfit of the Allan deviation.

    The pair spans the largest |z| and its neighbors in which z has the same sign and exceeds 2 in magnitude. None if no
    |z| reaches `MIN_FAILING_SCORE`. A z that is not finite counts as 0.
    """
    z = np.where(np.isfinite(curve.z), curve.z, 0.0)
    top = int(np.argmax(np.abs(z)))
    if abs(z[top]) < MIN_FAILING_SCORE:
        return None
    low, high = run_at(z * np.sign(z[top]) > 2.0, top)
    return float(curve.tau[low]), float(curve.tau[high])

"""Local maximum of a rise of logL that has no derivative, by the simplex method (Nelder & Mead 1965)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.threads import stop_if_unwanted

if TYPE_CHECKING:
    from collections.abc import Callable

#: Minimum ΔlogL of changed shapes; smaller changes are not made. It is a change by √(2·0.001) = 0.045 standard errors.
MIN_SHAPE_DELTA_LOGL = 1e-3
#: Size of the simplex, in units of its first steps, and spread of its values, nats, at which the search ends.
TOLERANCES = {"xatol": 1e-3, "fatol": 1e-4}
#: Maximum number of steps of the simplex. Chosen by judgment; not measured.
MAX_SIMPLEX_STEPS = 300


def local_maximum(
    gain: Callable[[Array], float], start: Array, steps: Array
) -> tuple[Array, float]:
    """Pair: point near `start` with the largest `gain`, shape of `start`, and its gain.

    `steps` are the first changes of each coordinate; the search measures distances in these units. `gain` may return −∞
    where a point is not allowed.
    """
    from scipy.optimize import minimize

    def loss(x: Array, *_: Any, **__: Any) -> float:
        """Negative gain at `start` + `steps` · x; a large number if the gain is −∞."""
        return min(-gain(start + steps * x), 1e300)

    stop_if_unwanted()
    corners = np.vstack([np.zeros(start.size), np.eye(start.size)])
    options: Any = {"initial_simplex": corners, "maxiter": MAX_SIMPLEX_STEPS, **TOLERANCES}
    found = minimize(loss, corners[0], method="Nelder-Mead", options=options)
    return start + steps * found.x, -float(found.fun)

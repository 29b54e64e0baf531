"""Standard errors of amplitudes that include the uncertainty of the noise model.

The variance is that under the fitted noise, plus twice the variance of the value over the uncertain noise parameters
(Kenward & Roger 1997). Degrees of freedom follow from the variance of the variance (Satterthwaite 1946).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.fit.stamped.candidates import CURVATURE_STEP

if TYPE_CHECKING:
    from allanite.fit.stamped.candidates import FittedNoise


def amplitude_errors(best: FittedNoise) -> tuple[Array, Array]:
    """Pair of arrays, shape (k,): standard errors of amplitudes, with that of the noise, and their degrees of freedom."""
    neighbors = [
        (low.amplitudes, low.covariance.diagonal()) for pair in best.neighbors for low in pair
    ]
    return combined_errors(best, neighbors, best.regressed.covariance.diagonal())


def combined_errors(
    best: FittedNoise, neighbors: list[tuple[Array, Array]], variance: Array
) -> tuple[Array, Array]:
    """Pair of arrays, shape (k,): standard errors of k values, and their degrees of freedom (at least 1).

    The errors include the uncertainty of the noise parameters. `variance` is that of the values under the fitted noise.
    `neighbors` holds (values, variances) one step below and above the fit, for each noise parameter in turn.
    """
    pairs = list(zip(neighbors[::2], neighbors[1::2], strict=True))
    moved, changed = (
        np.array([b[q] - a[q] for a, b in pairs]) * (0.5 / CURVATURE_STEP) for q in (0, 1)
    )
    more = np.einsum("ki,kl,li->i", moved, best.covariance, moved)
    scatter = np.einsum("ki,kl,li->i", changed, best.covariance, changed)
    freedom = 2.0 * variance**2 / np.maximum(scatter, 1e-300)
    return np.sqrt(variance + 2.0 * more), np.maximum(freedom, 1.0)

"""Where a series steps: the height at every sample, tested under the fitted noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.threads import stop_if_unwanted
from allanite.fit.stamped.likelihood import whitened

if TYPE_CHECKING:
    from allanite.fit.stamped.likelihood import StampedSeries
    from allanite.fit.stamped.noise import StampedNoise

__all__ = ["best_step"]

Array = NDArray[np.float64]
#: Steps whitened at a time.
COLUMNS = 256
#: Distance, in samples, of the steps tried first; about the best of these every one is tried.
COARSE = 8


def best_step(series: StampedSeries, noise: StampedNoise) -> tuple[int, float]:
    """Return the row at which a step explains most, and the square of its height over its standard error.

    A step at row i lifts rows i and later. The amplitudes of the known functions are fitted with each.
    """
    there = np.ones(series.n, dtype=bool)
    columns = np.vstack([series.values, series.design])
    found, variances = whitened(noise, series.times, there, columns)
    root = 1.0 / np.sqrt(variances)
    basis, _ = np.linalg.qr((found[1:] * root).T)
    values = found[0] * root
    values = values - basis @ (basis.T @ values)

    def squares(rows: NDArray[np.int64]) -> Array:
        out = np.zeros(rows.size)
        for first in range(0, rows.size, COLUMNS):
            stop_if_unwanted()
            some = rows[first : first + COLUMNS]
            steps = (np.arange(series.n)[None, :] >= some[:, None]).astype(float)
            white, _ = whitened(noise, series.times, there, steps)
            white = white * root
            known = white @ basis
            size = (white**2).sum(axis=1) - (known**2).sum(axis=1)
            # A step that the known functions already make has no height of its own.
            own = size > 1e-9 * (white**2).sum(axis=1)
            out[first : first + COLUMNS] = np.where(
                own, (white @ values) ** 2 / np.where(own, size, 1.0), 0.0
            )
        return out

    rows = np.arange(2, series.n - 1, COARSE, dtype=np.int64)
    best = int(rows[np.argmax(squares(rows))])
    near = np.arange(max(1, best - COARSE), min(series.n - 1, best + COARSE + 1), dtype=np.int64)
    height = squares(near)
    return int(near[np.argmax(height)]), float(height.max())

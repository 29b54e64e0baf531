"""Search for a step in a series: a step is fitted at every sample and tested with the fitted noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.threads import stop_if_unwanted
from allanite.fit.stamped.likelihood import innovations

if TYPE_CHECKING:
    from allanite.fit.stamped.likelihood import StampedSeries
    from allanite.fit.stamped.noise import StampedNoise

#: Probability that a record without steps has a false step.
FALSE_ALARM_PROBABILITY = 0.01
#: Number of candidate steps that are whitened together; limits memory.
STEPS_PER_BLOCK = 256
#: Distance in samples of the candidate steps of the first pass. The second pass tries every sample near the best one.
COARSE_DISTANCE = 8


def significant_step(series: StampedSeries, noise: StampedNoise) -> float | None:
    """Time, s, of the first sample after the most significant step; None if no step is significant.

    A step at each time is fitted together with the known functions of `series`. Every eighth sample is tried first, then
    all samples around the best one. The false-alarm probability is 1 % for the whole series (Bonferroni).
    """
    from scipy.special import chdtrc

    there = np.ones(series.n, dtype=bool)
    columns = np.vstack([series.values, series.design])
    found, variances = innovations(noise, series.times, there, columns)
    root = 1.0 / np.sqrt(variances)
    basis, _ = np.linalg.qr((found[1:] * root).T)
    values = found[0] * root
    values = values - basis @ (basis.T @ values)

    def squares(rows: NDArray[np.int64]) -> Array:
        """Square of (height / standard error) of a step that begins at each of these samples; 0 if it is not separable."""
        out = np.zeros(rows.size)
        for first in range(0, rows.size, STEPS_PER_BLOCK):
            stop_if_unwanted()
            some = rows[first : first + STEPS_PER_BLOCK]
            steps = (np.arange(series.n)[None, :] >= some[:, None]).astype(float)
            white, _ = innovations(noise, series.times, there, steps)
            white = white * root
            known = white @ basis
            size = (white**2).sum(axis=1) - (known**2).sum(axis=1)
            # A step that is a sum of the known functions cannot be fitted separately.
            own = size > 1e-9 * (white**2).sum(axis=1)
            out[first : first + STEPS_PER_BLOCK] = np.where(
                own, (white @ values) ** 2 / np.where(own, size, 1.0), 0.0
            )
        return out

    rows = np.arange(2, series.n - 1, COARSE_DISTANCE, dtype=np.int64)
    best = int(rows[np.argmax(squares(rows))])
    near = np.arange(
        max(1, best - COARSE_DISTANCE),
        min(series.n - 1, best + COARSE_DISTANCE + 1),
        dtype=np.int64,
    )
    height = squares(near)
    if series.n * float(chdtrc(1, height.max())) >= FALSE_ALARM_PROBABILITY:
        return None
    return float(series.times[near[np.argmax(height)]])

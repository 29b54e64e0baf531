"""Residuals over frequency: the interval in which the measured spectrum differs most from the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import rows_of

if TYPE_CHECKING:
    from allanite.fit.result import Fit

#: Minimum |Σz|/√k of an interval of k bins that counts as a failure, standard deviations. About 0.2 % of true models have
#: an interval above this limit, among all intervals of some 500 independent scores.
MIN_INTERVAL_SCORE = 5.2


def rows(fit: Fit) -> list[dict[str, Any]]:
    """List of dicts, one per frequency bin: limits in Hz, ratio of measured to expected power, standard normal score z."""
    low, high = fit.data.bins.limits(fit.data.rate)
    ratio = fit.solution.power / fit.solution.spectrum
    return rows_of(low_hz=low, high_hz=high, ratio=ratio, z=fit.z)


def worst(fit: Fit) -> tuple[float, float] | None:
    """Pair (lowest, highest frequency), Hz, of the interval in which the fit fails most; None if it fails nowhere.

    Among all intervals of k neighboring bins, this one has the largest |Σz|/√k, where z is the score of a bin. The fit
    fails there if this value is at least `MIN_INTERVAL_SCORE`.
    """
    z = fit.z
    total = np.concatenate([[0.0], np.cumsum(z)])
    first, last = np.triu_indices(z.size + 1, 1)
    size = np.abs(total[last] - total[first]) / np.sqrt(last - first)
    top = int(np.argmax(size))
    if size[top] < MIN_INTERVAL_SCORE:
        return None
    low, high = fit.data.bins.limits(fit.data.rate)
    return float(low[first[top]]), float(high[last[top] - 1])

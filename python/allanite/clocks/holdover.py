"""Where a clock will be without its reference: expected phase and band after some time, under the fitted noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.clocks.words import time_text
from allanite.fit.stamped.uncertainty import predicted_with_noise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.stamped.candidates import FittedNoise
    from allanite.fit.stamped.likelihood import StampedSeries

__all__ = ["Holdover", "holdover_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Holdover:
    """Prediction of the phase.

    Attributes
    ----------
    after : float
        s after the last sample.
    expected : float
        Phase if nothing is done, s.
    std : float
        Standard deviation of the phase about it: what remains if a servo goes on with the best frequency, s.
    low, high : float
        95 % interval of the phase, s.
    """

    after: float
    expected: float
    std: float
    low: float
    high: float

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as JSON."""
        return {
            "after_s": self.after,
            "expected_s": self.expected,
            "std_s": self.std,
            "low_s": self.low,
            "high_s": self.high,
        }

    def __str__(self) -> str:
        half = time_text(0.5 * (self.high - self.low))
        hours = self.after / 3600.0
        return f"holdover after {hours:.4g} h: expected {time_text(self.expected)} ± {half} (95 %)"


#: Weight below which a noise model is left out of a prediction.
LEAST_WEIGHT = 0.02


def holdover_of(
    fits: Sequence[FittedNoise], series: StampedSeries, after: float, design: Array
) -> Holdover:
    """Return the prediction for one time, averaged over noise models.

    A slow noise that the record hardly shows decides how far the clock runs off. Models are weighted by e to the power of
    their log-likelihood less 1 for each number (Akaike 1978): how well each predicts.

    Parameters
    ----------
    fits : sequence of FittedNoise
    series : StampedSeries
        Times from the last sample, s.
    after : float
        s.
    design : ndarray, shape (k, 1)
        Known functions at that time.
    """
    from scipy.optimize import brentq
    from scipy.special import stdtr

    heights = np.array([f.regressed.log_likelihood - f.candidate.numbers for f in fits])
    weights = np.exp(heights - heights.max())
    weights = np.where(weights < LEAST_WEIGHT * weights.sum(), 0.0, weights)
    weights /= weights.sum()
    at = np.array([float(series.times[-1]) + after])
    rows = [
        (weight, *(float(part[0]) for part in predicted_with_noise(fit, series, at, design)))
        for weight, fit in zip(weights.tolist(), fits, strict=True)
        if weight > 0.0
    ]
    weight, mean, std, freedom = np.array(rows).T
    middle = float(weight @ mean)
    spread = float(np.sqrt(weight @ (std**2 + (mean - middle) ** 2)))
    far = float((np.abs(mean - middle) + 1e3 * std).max())

    def end(share: float) -> float:
        def beyond(x: float) -> float:
            return float(weight @ stdtr(freedom, (x - mean) / std)) - share

        return float(brentq(beyond, middle - far, middle + far, xtol=1e-6 * spread))

    return Holdover(after, middle, spread, end(0.025), end(0.975))

"""Holdover: the phase of a clock some time after it lost its reference, predicted with the fitted noise."""

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
        Time after the last sample, s.
    expected : float
        Expected phase if the clock runs on without correction, s.
    std : float
        Standard deviation of the phase about `expected`, s. This error remains even if a servo continues with the best
        frequency.
    low, high : float
        95 % interval of the phase, s.
    """

    after: float
    expected: float
    std: float
    low: float
    high: float

    def to_dict(self) -> dict[str, Any]:
        """Return the attributes as a dictionary of values that JSON can hold."""
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


#: Noise models with a smaller weight are not used for a prediction. Chosen by judgment; not measured.
MIN_WEIGHT = 0.02


def holdover_of(
    fits: Sequence[FittedNoise], series: StampedSeries, after: float, design: Array
) -> Holdover:
    """Return the prediction for one time, averaged over noise models.

    The error in holdover depends on slow noise that is hardly visible in the record, so that one model is not enough.
    The weight of a model is exp(log-likelihood − number of coefficients) (Akaike 1978), which measures how well it
    predicts.

    Parameters
    ----------
    fits : sequence of FittedNoise
    series : StampedSeries
        The phase that was fitted; its times are relative to the last sample, s.
    after : float
        Time after the last sample, s.
    design : ndarray, shape (k, 1)
        Known functions (offset, frequency, drift, …) at that time.
    """
    from scipy.optimize import brentq
    from scipy.special import stdtr

    heights = np.array([f.regressed.log_likelihood - f.candidate.numbers for f in fits])
    weights = np.exp(heights - heights.max())
    weights = np.where(weights < MIN_WEIGHT * weights.sum(), 0.0, weights)
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

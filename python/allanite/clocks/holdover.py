"""Where a clock will be without its reference: expected phase and band after some time, under the fitted noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.clocks.words import time_text
from allanite.fit.stamped.uncertainty import predicted_with_noise

if TYPE_CHECKING:
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


def holdover_of(best: FittedNoise, series: StampedSeries, after: float, design: Array) -> Holdover:
    """Return the prediction for one time.

    Parameters
    ----------
    best : FittedNoise
    series : StampedSeries
        Times from the last sample, s.
    after : float
        s.
    design : ndarray, shape (k, 1)
        Known functions at that time.
    """
    from scipy.special import stdtrit

    last = float(series.times[-1])
    mean, std, freedom = predicted_with_noise(best, series, np.array([last + after]), design)
    half = float(stdtrit(freedom[0], 0.975)) * float(std[0])
    return Holdover(
        after, float(mean[0]), float(std[0]), float(mean[0]) - half, float(mean[0]) + half
    )

"""Holdover: the phase of a clock some time after it lost its reference, predicted with the fitted noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.clocks.words import time_text
from allanite.fit.stamped.posterior import posterior_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.stamped.candidates import FittedNoise
    from allanite.fit.stamped.likelihood import StampedSeries
    from allanite.fit.stamped.noise import StampedNoise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Holdover:
    """Prediction of the phase.

    Attributes
    ----------
    after : float
        Time after the last sample, s.
    expected : float
        Expected phase if the clock runs on without new corrections, s.
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

    def shifted(self, phase: float) -> Holdover:
        """`Holdover` whose expected phase and interval are larger by the known phase, s."""
        return Holdover(
            self.after, self.expected + phase, self.std, self.low + phase, self.high + phase
        )

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the five attributes, s; each name ends with ``_s``."""
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


#: Noise models with a smaller share of the evidence are not used for a prediction. Chosen by judgment; not measured.
MIN_EVIDENCE_SHARE = 0.02


def holdovers_of(
    fits: Sequence[FittedNoise], series: StampedSeries, after: Sequence[float], design: Array
) -> list[Holdover]:
    """List of `Holdover`, one for each time in `after`, averaged over noise models and their coefficients.

    The error in holdover depends on slow noise that is hardly visible in the record, so one model is not enough. The
    weight of a model is its evidence; models with under 2 % are left out. Within a model, the prediction is averaged
    over the posterior of the coefficients.

    Parameters
    ----------
    fits : sequence of FittedNoise
    series : StampedSeries
        The phase that was fitted; its times are relative to the last sample, s.
    after : sequence of float, shape (m,)
        Ascending times after the last sample, s.
    design : ndarray, shape (k, m)
        Known functions (offset, frequency, drift, …) at these times.
    """
    heights = np.array([fit.evidence for fit in fits])
    shares = np.exp(heights - heights.max())
    shares = np.where(shares < MIN_EVIDENCE_SHARE * shares.sum(), 0.0, shares)
    times = float(series.times[-1]) + np.asarray(after, dtype=float)

    def prediction_of(noise: StampedNoise) -> tuple[float, tuple[Array, Array]]:
        """Pair (logL of a noise, (mean in s, variance in s²) of the phase at each time under this noise)."""
        log_likelihood, mean, variance = series.predicted(noise, times, design)
        return log_likelihood, (mean, variance)

    weights: list[Array] = []
    rows: list[tuple[Array, Array]] = []
    for share, fit in zip((shares / shares.sum()).tolist(), fits, strict=True):
        if share > 0.0:
            own, values = posterior_points(fit, prediction_of)
            weights.append(share * own)
            rows += values
    means, variances = (np.array(part).T for part in zip(*rows, strict=True))
    weight = np.concatenate(weights)
    return [
        _holdover(time, weight, mean, np.sqrt(variance))
        for time, mean, variance in zip(after, means, variances, strict=True)
    ]


def _holdover(after: float, weight: Array, mean: Array, std: Array) -> Holdover:
    """`Holdover` at the time `after` (s) from a mixture of normal distributions with weights, means and deviations (s)."""
    from scipy.optimize import brentq
    from scipy.special import ndtr

    middle = float(weight @ mean)
    spread = float(np.sqrt(weight @ (std**2 + (mean - middle) ** 2)))
    # No part has more than 2.5 % outside of its own ±10 standard deviations.
    low, high = float((mean - 10.0 * std).min()), float((mean + 10.0 * std).max())

    def quantile(share: float) -> float:
        """Phase below which the mixture has the probability `share`, s."""
        return float(
            brentq(
                lambda x: float(weight @ ndtr((x - mean) / std)) - share,
                low,
                high,
                xtol=1e-6 * spread,
            )
        )

    return Holdover(after, middle, spread, quantile(0.025), quantile(0.975))

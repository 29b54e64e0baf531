"""Holdover: the phase of a clock some time after it lost its reference, predicted with the fitted noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.clocks.words import time_text
from allanite.common.documents import fields_dict
from allanite.fit.rivals.evidence import PRIOR_LOG_RANGE, parameter_cost
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
        """Copy (`Holdover`) with a known `phase`, s, added to the expected phase and to both ends of its interval."""
        moved = {name: getattr(self, name) + phase for name in ("expected", "low", "high")}
        return replace(self, **moved)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with ``after_s``, ``expected_s``, ``std_s``, ``low_s`` and ``high_s``."""
        return {f"{name}_s": value for name, value in fields_dict(self).items()}

    def __str__(self) -> str:
        half = time_text(0.5 * (self.high - self.low))
        hours = self.after / 3600.0
        return f"holdover after {hours:.4g} h: expected {time_text(self.expected)} ± {half} (95 %)"


#: Models with a smaller share of the evidence are not used for a prediction. Chosen by judgment; not measured.
MIN_EVIDENCE_SHARE = 0.02
#: Lowest and highest standard deviation of the prior of the drift, over the standard error of the drift (over the drift
#: itself, if that is larger), and their ratio from one to the next. The half-width of a band at 3 h differs by 2.1 % rms
#: from that with half of the lowest and of the ratio, and twice the highest (benches/decisions/chosen_values.py drift).
MIN_SPREAD, MAX_SPREAD, SPREAD_RATIO = 0.3, 3.0, 2.0


@dataclass(frozen=True, eq=False)
class PhaseModels:
    """Noise models of a phase that were fitted with the same known functions; with `drifts`, the last one is the drift.

    `series` is the phase that was fitted, and the known functions; its times are relative to the last sample, s.
    """

    fits: Sequence[FittedNoise]
    series: StampedSeries
    drifts: bool = False

    def spreads(self, fit: FittedNoise) -> Array:
        """Trial values, each twice the previous one, for the standard deviation of the normal prior of the drift.

        The first is 0.3 standard errors of the drift. The last is about 3 times the drift's absolute value or standard
        error, whichever is larger. Empty without a drift.
        """
        if not self.drifts:
            return np.zeros(0)
        error = float(np.sqrt(fit.regressed.covariance[-1, -1]))
        top = MAX_SPREAD * max(error, abs(float(fit.regressed.amplitudes[-1])))
        count = 1 + round(float(np.log(top / (MIN_SPREAD * error)) / np.log(SPREAD_RATIO)))
        return MIN_SPREAD * error * SPREAD_RATIO ** np.arange(count, dtype=np.float64)


def holdovers_of(
    models: Sequence[PhaseModels], after: Sequence[float], designs: Sequence[Array]
) -> list[Holdover]:
    """One `Holdover` (predicted phase error without a reference) for each time in `after` (s after the last sample).

    Each is a Bayesian average over the noise models, their coefficients and the drift, because slow noise and drift are
    hardly visible in the record. Models with under 2 % of the total evidence are left out. The priors are uniform in
    the logarithm of each coefficient, and of the width of the prior of the drift. `designs`, shape (k, m), are the
    known functions of each of the `models` at these times.
    """
    parts = [
        _Part(own, fit, np.asarray(after, dtype=float), design)
        for own, design in zip(models, designs, strict=True)
        for fit in own.fits
    ]
    heights = np.array([part.log_evidence for part in parts])
    shares = np.exp(heights - heights.max())
    kept = shares >= MIN_EVIDENCE_SHARE * shares.sum()
    points = [
        part.points(float(heights.max())) for part, used in zip(parts, kept, strict=True) if used
    ]
    weight, means, variances = (np.concatenate(column) for column in zip(*points, strict=True))
    weight /= weight.sum()
    return [
        _holdover(time, weight, mean, np.sqrt(variance))
        for time, mean, variance in zip(after, means.T, variances.T, strict=True)
    ]


class _Part:
    """Prediction of the phase under one noise model, with or without a drift; `log_evidence` is in nats."""

    def __init__(self, models: PhaseModels, fit: FittedNoise, after: Array, design: Array) -> None:
        self._fit, self._series, self._design = fit, models.series, design
        self._times = float(models.series.times[-1]) + after
        spreads = models.spreads(fit)
        # With a drift, the flat prior comes first: it selects the points, but has no weight.
        self._spreads = np.append(np.inf, spreads)
        step = np.log(SPREAD_RATIO) / PRIOR_LOG_RANGE
        self._prior = np.append(0.0, np.full(spreads.size, step)) if spreads.size else np.ones(1)
        # The variance of the logarithm of a coefficient is a quarter of that of its square.
        cost = sum(parameter_cost(4.0 / v) for v in fit.covariance.diagonal().tolist())
        self._height = fit.regressed.log_likelihood - cost
        likelihoods, _, _ = self._predicted(fit.noise)
        self.log_evidence = float(self._height + np.log(self._relative(likelihoods).sum()))

    def _predicted(self, noise: StampedNoise) -> tuple[Array, Array, Array]:
        """(logL, mean, variance) of the prediction of the phase with the noise coefficients `noise`.

        logL has one value per prior width of the drift, shape (p,). `mean` (s) and `variance` (s²) are those of the
        phase at each of the m prediction times, shape (p, m).
        """
        return self._series.predicted(noise, self._times, self._design, self._spreads)

    def _relative(self, likelihoods: Array) -> Array:
        """Unnormalized posterior weight of each prior width of the drift, the last axis of `likelihoods` (logL)."""
        return np.asarray(self._prior * np.exp(likelihoods - likelihoods[..., :1]))

    def points(self, top: float) -> tuple[Array, Array, Array]:
        """(weights, means, variances) of q normal distributions; their mixture predicts the phase with this model.

        Weights have shape (q,), means (s) and variances (s²) the shape (q, times). The weights are evidences divided by
        e^`top`, so that those of several models can be compared.
        """

        def prediction_of(noise: StampedNoise) -> tuple[float, tuple[Array, Array, Array]]:
            """Tuple (log-likelihood of `noise` with the first prior width of the drift, result of ``_predicted``)."""
            found = self._predicted(noise)
            return float(found[0][0]), found

        own, values = posterior_points(self._fit, prediction_of)
        likelihoods, means, variances = (np.array(part) for part in zip(*values, strict=True))
        weights = np.exp(self._height - top) * own[:, None] * self._relative(likelihoods)
        times = means.shape[-1]
        return weights.ravel(), means.reshape(-1, times), variances.reshape(-1, times)


def _holdover(after: float, weight: Array, mean: Array, std: Array) -> Holdover:
    """`Holdover` at the time `after` (s) from a mixture of normal distributions with weights, means and deviations (s)."""
    from scipy.optimize import brentq
    from scipy.special import ndtr

    middle = float(weight @ mean)
    spread = float(np.sqrt(weight @ (std**2 + (mean - middle) ** 2)))
    # No part has more than 2.5 % outside of its own ±10 standard deviations.
    low, high = float((mean - 10.0 * std).min()), float((mean + 10.0 * std).max())

    def quantile(share: float) -> float:
        """Phase in s at which the cumulative distribution function of the mixture is `share`: the quantile."""
        return float(
            brentq(
                lambda x: float(weight @ ndtr((x - mean) / std)) - share,
                low,
                high,
                xtol=1e-6 * spread,
            )
        )

    return Holdover(after, middle, spread, quantile(0.025), quantile(0.975))

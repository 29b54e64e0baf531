"""Noise models of a series at arbitrary times: sums of white noise and power laws, fitted by likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.threads import stop_if_unwanted
from allanite.effects import Model
from allanite.fit.stamped.noise import StampedNoise, added

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Stochastic
    from allanite.effects.terms import Term
    from allanite.fit.stamped.likelihood import Regressed, StampedSeries

Array = NDArray[np.float64]
#: Maximum |ln| of the ratio of two variances in the search: a part with e^−16 of the variance of another is invisible.
#: Chosen by judgment; not measured.
MAX_LOG_VARIANCE_RATIO = 16.0
#: Tolerance of the log-variance ratio in the one-dimensional search. logL changes by 1e-4 at most if the ratio has a
#: relative error of 10 %.
RATIO_TOLERANCE = 1e-3
#: Step of numerical second derivatives, in logarithms of variances or in exponents. Chosen by judgment; not measured.
CURVATURE_STEP = 0.1
#: Step of numerical first derivatives, in the same units. Chosen by judgment; not measured.
GRADIENT_STEP = 1e-4
#: Maximum iterations of the optimization. Chosen by judgment; not measured.
MAX_ITERATIONS = 50
#: Duration over the time constant of a lag below which the variance of its integral is computed by a series, because
#: the closed form cancels. Chosen by judgment; not measured.
MAX_SERIES_DURATION = 0.02
#: Minimum curvature of logL in a log-variance: limits its standard deviation to 1/√0.1 = 3 e-folds.
#: Chosen by judgment; not measured.
MIN_CURVATURE = 0.1


@dataclass(frozen=True)
class Candidate:
    """A sum of noise effects whose coefficients are fitted; the last effect may have a fitted exponent.

    Attributes
    ----------
    effects : tuple of Stochastic
        Effects without coefficients.
    exponents : (float, float) or None
        Range of the exponent of the last effect; None if no exponent is fitted.
    """

    effects: tuple[Stochastic, ...]
    exponents: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Short names of the effects joined by plus signs."""
        return "+".join(effect.short for effect in self.effects)

    @property
    def numbers(self) -> int:
        """Number of fitted parameters."""
        return len(self.effects) + (self.exponents is not None)


@dataclass(frozen=True, eq=False)
class FittedNoise:
    """The most likely noise of a candidate, and its uncertainty.

    Attributes
    ----------
    candidate : Candidate
    model : Model
        The effects with fitted coefficients.
    noise : StampedNoise
        The fitted noise.
    regressed : Regressed
        Regression of the known functions under this noise.
    price : float
        Cost of the parameters in the evidence, ½ ln n for each (Schwarz 1978).
    """

    candidate: Candidate
    model: Model
    noise: StampedNoise
    regressed: Regressed
    price: float
    _place: Array
    _at: Callable[[Array], StampedNoise]
    _series: StampedSeries

    @property
    def evidence(self) -> float:
        """Log-evidence: restricted log-likelihood minus `price`."""
        return self.regressed.log_likelihood - self.price

    @property
    def coefficients(self) -> Array:
        """Fitted coefficients, relative to the coefficient with which each noise has a scatter of 1 over the record."""
        return np.asarray(np.exp(0.5 * self._place[: len(self.candidate.effects)]))

    def noise_of(self, coefficients: Array) -> StampedNoise:
        """Noise with other `coefficients`; a fitted exponent is kept."""
        place = self._place.copy()
        place[: coefficients.size] = 2.0 * np.log(np.maximum(coefficients, 1e-300))
        return self._at(place)

    def noise_at(self, number: int, sign: float) -> StampedNoise:
        """Noise with one parameter (log-variance or exponent) changed by `sign` times `CURVATURE_STEP` from the fit."""
        place = self._place.copy()
        place[number] += sign * CURVATURE_STEP
        return self._at(place)

    @cached_property
    def neighbors(self) -> list[tuple[Regressed, Regressed]]:
        """Regressions one `CURVATURE_STEP` below and above the fit, for each noise parameter."""
        return [
            (
                self._series.regressed(self.noise_at(i, -1.0)),
                self._series.regressed(self.noise_at(i, 1.0)),
            )
            for i in range(self._place.size)
        ]

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the log-variances and the exponent, from the inverse curvature of logL."""
        k = self._place.size
        middle = self.regressed.log_likelihood
        sides = [sum(r.log_likelihood for r in pair) for pair in self.neighbors]
        curvature = np.diag([2.0 * middle - both for both in sides])
        for i in range(k):
            for j in range(i):
                both = 0.0
                for sign in (-1.0, 1.0):
                    place = self._place.copy()
                    place[[i, j]] += sign * CURVATURE_STEP
                    both += self._series.regressed(self._at(place)).log_likelihood
                cross = 0.5 * (sides[i] + sides[j] - both - 2.0 * middle)
                curvature[i, j] = curvature[j, i] = cross
        values, vectors = np.linalg.eigh(curvature / CURVATURE_STEP**2)
        # Limit the uncertainty in directions in which the likelihood is nearly flat.
        values = np.maximum(values, MIN_CURVATURE)
        return np.asarray((vectors / values) @ vectors.T)


def fit_noise(
    series: StampedSeries,
    candidate: Candidate,
    rate: float,
    form: Callable[[Term, float, int], StampedNoise],
    start: FittedNoise | None = None,
) -> FittedNoise:
    """The most likely coefficients (and exponent) of a candidate.

    Parameters
    ----------
    series : StampedSeries
    candidate : Candidate
    rate : float
        Nominal sampling rate to which the terms of effects refer, Hz.
    form : callable
        `sampled_noise` or `integrated_noise`.
    start : FittedNoise, optional
        Fit of some of the effects; its values start the optimization.
    """
    from scipy.optimize import minimize, minimize_scalar

    length = float(series.times[-1] - series.times[0])
    n = max(16, int(np.ceil(length * rate)) + 1)
    sizes = len(candidate.effects)
    fixed = [
        added([form(term, rate, n) for term in effect.unit_terms(rate)])
        for effect in candidate.effects[: sizes - (candidate.exponents is not None)]
    ]
    # Normalize each part by the scatter that it adds to the samples, so that relevant ratios are near 1.
    weights = [1.0 / _scatter(part, length) for part in fixed]

    def last(exponent: float) -> StampedNoise:
        """Noise of the last effect with this exponent, scaled so that it adds about 1 to the scatter of the samples."""
        effect: Any = candidate.effects[-1].with_values(exponent=float(exponent))
        part = added([form(term, rate, n) for term in effect.unit_terms(rate)])
        return part.scaled(1.0 / _scatter(part, length))

    def at(place: Array) -> StampedNoise:
        """Noise at log-variances (and an exponent)."""
        parts = [
            part.scaled(weight * float(np.exp(v)))
            for part, weight, v in zip(fixed, weights, place, strict=False)
        ]
        if candidate.exponents is not None:
            parts.append(last(place[-1]).scaled(float(np.exp(place[-2]))))
        return added(parts)

    def whole(free: Array) -> Array:
        """All log-variances from those relative to the first."""
        return np.concatenate([[0.0], free])

    def loss(free: Array) -> float:
        """Negative profiled log-likelihood at relative log-variances (and an exponent)."""
        stop_if_unwanted()
        return -series.regressed(at(whole(np.asarray(free, dtype=float)))).profiled

    if sizes == 1 and candidate.exponents is None:
        free = np.zeros(0)
    elif sizes == 2 and candidate.exponents is None:
        ratio = minimize_scalar(
            lambda v: loss(np.array([v])),
            bounds=(-MAX_LOG_VARIANCE_RATIO, MAX_LOG_VARIANCE_RATIO),
            method="bounded",
            options={"xatol": RATIO_TOLERANCE},
        )
        free = np.array([ratio.x])
    else:
        limits = [(-MAX_LOG_VARIANCE_RATIO, MAX_LOG_VARIANCE_RATIO)] * (sizes - 1)
        limits += [] if candidate.exponents is None else [candidate.exponents]
        first = _start_values(candidate, start, limits)
        found = minimize(
            loss,
            first,
            method="L-BFGS-B",
            bounds=limits,
            options={"eps": GRADIENT_STEP, "ftol": 1e-7, "gtol": 1e-2, "maxiter": MAX_ITERATIONS},
        )
        free = np.asarray(found.x)
    place = whole(free)
    scale = series.regressed(at(place)).scale
    # Rounding to doubles is no noise.
    if scale <= (np.finfo(float).eps * np.abs(series.values).max()) ** 2:
        raise InputError(
            "the samples have no noise: they are all equal, or a known function of time"
        )
    place[:sizes] += np.log(scale)
    noise = at(place)
    regressed = series.regressed(noise)
    effects: list[Stochastic] = []
    for i, effect in enumerate(candidate.effects):
        if i == len(fixed):
            effect = effect.with_values(exponent=float(place[-1]))
            part = added([form(term, rate, n) for term in effect.unit_terms(rate)])
            weight = 1.0 / _scatter(part, length)
        else:
            weight = weights[i]
        size = float(np.sqrt(weight * np.exp(place[i])))
        effects.append(effect.with_values(**{effect.coefficient: size}))
    price = 0.5 * candidate.numbers * float(np.log(max(series.n, 2)))
    return FittedNoise(candidate, Model(tuple(effects)), noise, regressed, price, place, at, series)


def _scatter(noise: StampedNoise, length: float) -> float:
    """Variance of a noise after `length` seconds, given its state at the start."""
    total = noise.white + noise.walk * length
    for variance, rate, summed in noise.lags:
        s = rate * length
        if not summed:
            grown = -float(np.expm1(-2.0 * s))
        elif s < MAX_SERIES_DURATION:
            # 2s − 3 + 4e^(−s) − e^(−2s), whose terms cancel.
            grown = s**3 * (2.0 / 3.0 - 0.5 * s) / rate**2
        else:
            less = -float(np.expm1(-s))
            grown = (2.0 * s - 2.0 * less - less**2) / rate**2
        total += variance * grown
    return total


def _start_values(
    candidate: Candidate, start: FittedNoise | None, limits: Sequence[tuple[float, float]]
) -> Array:
    """Start values of the optimization: those of `start`, with new effects at 1/10 of the largest; else the middle."""
    first = np.zeros(len(limits))
    sizes = len(candidate.effects)
    if candidate.exponents is not None:
        first[-1] = np.mean(candidate.exponents)
    if start is not None:
        known = dict(zip(start.candidate.effects, start._place.tolist(), strict=False))
        new = max(known.values()) - 2.3
        places = np.array([known.get(effect, new) for effect in candidate.effects])
        first[: sizes - 1] = (places - places[0])[1:]
        if candidate.exponents is not None:
            last = start.candidate.effects[-1].kind
            exponent = {"bias_instability": -1.0, "rate_random_walk": -1.8}.get(last)
            if start.candidate.exponents is not None:
                exponent = float(start._place[-1])
            first[-1] = first[-1] if exponent is None else exponent
            if sizes > 1 and len(start.candidate.effects) == sizes:
                first[sizes - 2] = float(start._place[sizes - 1] - start._place[0])
    low, high = np.array(limits).T
    return np.clip(first, low, high)

"""Noise models of a series at arbitrary times: sums of white noise and power laws, fitted by likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.threads import stop_if_unwanted
from allanite.effects import Model, Stochastic
from allanite.fit.stamped.noise import StampedNoise, sum_of_noises

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects.terms import Term
    from allanite.fit.stamped.likelihood import Regressed, StampedSeries

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
#: Duration over the time constant of a process below which the variance of its integral is computed by a series, because
#: the closed form cancels. Chosen by judgment; not measured.
MAX_SERIES_DURATION = 0.02
#: Minimum curvature of logL in a log-variance: limits its standard deviation to 1/√0.1 = 3 e-folds.
#: Chosen by judgment; not measured.
MIN_CURVATURE = 0.1


@dataclass(frozen=True)
class Candidate:
    """A sum of noise effects whose coefficients are fitted; the last has an exponent in the range `exponents`, if given."""

    effects: tuple[Stochastic, ...]
    exponents: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Short names of the effects joined by plus signs."""
        return "+".join(effect.short for effect in self.effects)

    @property
    def parameter_count(self) -> int:
        """Number of fitted parameters: one coefficient for each effect, and the exponent of the last effect if fitted."""
        return len(self.effects) + (self.exponents is not None)


@dataclass(frozen=True, eq=False)
class FittedNoise:
    """The most likely noise of a candidate, and its uncertainty.

    `regressed` is the regression of the known functions under this noise. `price` is the cost of the parameters in the
    evidence, ½ ln n for each (Schwarz 1978).
    """

    candidate: Candidate
    model: Model
    noise: StampedNoise
    regressed: Regressed
    price: float
    _parameters: Array
    _at: Callable[[Array], StampedNoise]
    _series: StampedSeries

    @property
    def evidence(self) -> float:
        """Log-evidence, nats: restricted log-likelihood minus ½ ln n for each fitted parameter."""
        return self.regressed.log_likelihood - self.price

    @property
    def coefficients(self) -> Array:
        """Array of the fitted coefficients, one per effect: standard deviations of the effects at the end of the record."""
        return np.asarray(np.exp(0.5 * self._parameters[: len(self.candidate.effects)]))

    def noise_of(self, coefficients: Array) -> StampedNoise:
        """`StampedNoise` in which the effects have the standard deviations `coefficients` at the end of the record."""
        parameters = self._parameters.copy()
        parameters[: coefficients.size] = 2.0 * np.log(np.maximum(coefficients, 1e-300))
        return self._at(parameters)

    def noise_at(self, places: int | list[int], sign: float) -> StampedNoise:
        """`StampedNoise` of the fitted parameters, with those at the indices `places` changed by `sign` · `CURVATURE_STEP`.

        The parameters are the log-variance of each effect, then the exponent of the last effect, if fitted.
        """
        parameters = self._parameters.copy()
        parameters[places] += sign * CURVATURE_STEP
        return self._at(parameters)

    @cached_property
    def neighbors(self) -> list[tuple[Regressed, Regressed]]:
        """List of a pair of `Regressed` for each noise parameter: one `CURVATURE_STEP` below and above its fitted value."""
        fits = (
            [self._series.regressed(self.noise_at(i, sign)) for sign in (-1.0, 1.0)]
            for i in range(self._parameters.size)
        )
        return [(below, above) for below, above in fits]

    @cached_property
    def covariance(self) -> Array:
        """Covariance matrix of the log-variances and the exponent, the inverse of the curvature of logL.

        The eigenvalues of the curvature are raised to at least 0.1. This limits the uncertainty where logL is nearly flat.
        """
        k = self._parameters.size
        middle = self.regressed.log_likelihood
        sides = [sum(r.log_likelihood for r in pair) for pair in self.neighbors]
        curvature = np.diag([2.0 * middle - both for both in sides])
        for i in range(k):
            for j in range(i):
                moved = [self._series.regressed(self.noise_at([i, j], s)) for s in (-1.0, 1.0)]
                both = moved[0].log_likelihood + moved[1].log_likelihood
                cross = 0.5 * (sides[i] + sides[j] - both - 2.0 * middle)
                curvature[i, j] = curvature[j, i] = cross
        values, vectors = np.linalg.eigh(curvature / CURVATURE_STEP**2)
        # Limit the uncertainty in directions in which the likelihood is nearly flat.
        values = np.maximum(values, MIN_CURVATURE)
        return np.asarray((vectors / values) @ vectors.T)

    def amplitude_errors(self) -> tuple[Array, Array]:
        """Pair of arrays, shape (k,): standard errors of the amplitudes of the known functions, and degrees of freedom."""
        neighbors = [
            (r.amplitudes, r.covariance.diagonal()) for pair in self.neighbors for r in pair
        ]
        return self.combined_errors(neighbors, self.regressed.covariance.diagonal())

    def combined_errors(
        self, neighbors: list[tuple[Array, Array]], variance: Array
    ) -> tuple[Array, Array]:
        """Pair of arrays, shape (k,): standard errors of k values, and their degrees of freedom (at least 1).

        The errors include the uncertainty of the noise parameters. `variance` is that of the values under the fitted noise.
        Twice the variance of the values over the uncertain parameters is added (Kenward & Roger 1997). The degrees of
        freedom follow from the variance of the variance (Satterthwaite 1946). `neighbors` holds (values, variances) one
        step below and above the fit, for each noise parameter in turn.
        """
        pairs = list(zip(neighbors[::2], neighbors[1::2], strict=True))
        moved, changed = (
            np.array([b[q] - a[q] for a, b in pairs]) * (0.5 / CURVATURE_STEP) for q in (0, 1)
        )
        more = np.einsum("ki,kl,li->i", moved, self.covariance, moved)
        scatter = np.einsum("ki,kl,li->i", changed, self.covariance, changed)
        freedom = 2.0 * variance**2 / np.maximum(scatter, 1e-300)
        return np.sqrt(variance + 2.0 * more), np.maximum(freedom, 1.0)


def fit_noise(
    series: StampedSeries,
    candidate: Candidate,
    rate: float,
    form: Callable[[Term, float, int], StampedNoise],
    start: FittedNoise | None = None,
) -> FittedNoise:
    """`FittedNoise` with the most likely coefficients (and exponent) of a candidate; `InputError` without noise.

    `rate` is the nominal sampling rate to which the terms of effects refer, Hz. `form` is `sampled_noise` or
    `integrated_noise`. `start` is a fit of some of the effects.
    """
    parts = _NormalizedNoise.of(candidate, series, rate, form)
    parameters = np.concatenate([[0.0], _relative_log_variances(series, parts, start)])
    scale = series.regressed(parts.at(parameters)).scale
    # Rounding to doubles is no noise.
    if scale <= (np.finfo(float).eps * np.abs(series.values).max()) ** 2:
        raise InputError(
            "the samples have no noise: they are all equal, or a known function of time"
        )
    parameters[: len(candidate.effects)] += np.log(scale)
    noise = parts.at(parameters)
    price = 0.5 * candidate.parameter_count * float(np.log(max(series.n, 2)))
    regressed = series.regressed(noise)
    return FittedNoise(
        candidate, parts.model(parameters), noise, regressed, price, parameters, parts.at, series
    )


@dataclass(frozen=True, eq=False)
class _NormalizedNoise:
    """Noise of a candidate as a function of its log-variances, and of the exponent of its last effect.

    Each part is normalized to the variance 1 at the end of the record, so that relevant ratios are near 1. `normalized`
    returns the noise of an effect at coefficient 1, and its weight: 1 over its variance at the end of the record. `fixed`
    are those of the effects without a fitted exponent.
    """

    candidate: Candidate
    normalized: Callable[[Stochastic], tuple[StampedNoise, float]]
    fixed: list[tuple[StampedNoise, float]]

    @classmethod
    def of(
        cls,
        candidate: Candidate,
        series: StampedSeries,
        rate: float,
        form: Callable[[Term, float, int], StampedNoise],
    ) -> _NormalizedNoise:
        """`_NormalizedNoise`: noise of each effect of a candidate, scaled to the variance 1 at the end of a series.

        `rate` is the nominal sampling rate, Hz. Of the series only its duration is used.
        """
        length = float(series.times[-1] - series.times[0])
        n = max(16, int(np.ceil(length * rate)) + 1)

        def normalized(effect: Stochastic) -> tuple[StampedNoise, float]:
            """Pair: noise of an effect at coefficient 1, and 1 over its variance at the end of the record."""
            noise = sum_of_noises([form(term, rate, n) for term in effect.unit_terms(rate)])
            return noise, 1.0 / _variance_after(noise, length)

        fixed = candidate.effects[: len(candidate.effects) - (candidate.exponents is not None)]
        return cls(candidate, normalized, [normalized(effect) for effect in fixed])

    def _last(self, exponent: float) -> Stochastic:
        """Copy of the candidate's last effect with this exponent."""
        return self.candidate.effects[-1].with_values(exponent=float(exponent))

    def at(self, parameters: Array) -> StampedNoise:
        """`StampedNoise` with these parameters: ln of each effect's variance at the end of the record, exponent."""
        sizes = np.exp(parameters).tolist()
        parts = [
            part.scaled(weight * size)
            for (part, weight), size in zip(self.fixed, sizes, strict=False)
        ]
        if self.candidate.exponents is not None:
            part, weight = self.normalized(self._last(parameters[-1]))
            parts.append(part.scaled(weight).scaled(sizes[-2]))
        return sum_of_noises(parts)

    def model(self, parameters: Array) -> Model:
        """`Model` of the candidate's effects, with the coefficients (in their units) that follow from `parameters`."""
        effects, weights = list(self.candidate.effects), [weight for _, weight in self.fixed]
        if self.candidate.exponents is not None:
            effects[-1] = self._last(parameters[-1])
            weights.append(self.normalized(effects[-1])[1])
        sizes = np.sqrt(weights * np.exp(parameters[: len(effects)]))
        values = zip(effects, sizes.tolist(), strict=True)
        return Model(tuple(e.with_values(**{e.coefficient: size}) for e, size in values))


def _relative_log_variances(
    series: StampedSeries, parts: _NormalizedNoise, start: FittedNoise | None
) -> Array:
    """Most likely log-variances relative to that of the first effect, then the exponent if it is fitted.

    Variances are those at the end of the record. Ratios are limited to e^±16. `start` is a fit of some of the effects.
    Empty for one effect without a fitted exponent.
    """
    from scipy.optimize import minimize, minimize_scalar

    candidate = parts.candidate
    sizes = len(candidate.effects)
    if sizes == 1 and candidate.exponents is None:
        return np.zeros(0)

    def loss(free: Array) -> float:
        """Negative restricted log-likelihood, maximized over a common factor on the variances of all effects."""
        stop_if_unwanted()
        parameters = np.concatenate([[0.0], np.asarray(free, dtype=float)])
        return -series.regressed(parts.at(parameters)).profiled

    limits = [(-MAX_LOG_VARIANCE_RATIO, MAX_LOG_VARIANCE_RATIO)] * (sizes - 1)
    if sizes == 2 and candidate.exponents is None:
        ratio = minimize_scalar(
            lambda v: loss(np.array([v])),
            bounds=limits[0],
            method="bounded",
            options={"xatol": RATIO_TOLERANCE},
        )
        return np.array([ratio.x])
    limits += [] if candidate.exponents is None else [candidate.exponents]
    found = minimize(
        loss,
        _start_values(candidate, start, limits),
        method="L-BFGS-B",
        bounds=limits,
        options={"eps": GRADIENT_STEP, "ftol": 1e-7, "gtol": 1e-2, "maxiter": MAX_ITERATIONS},
    )
    return np.asarray(found.x)


def _variance_after(noise: StampedNoise, length: float) -> float:
    """Variance of a noise after `length` seconds, given its state at the start; it includes the white variance."""
    total = noise.white + noise.walk * length
    for variance, rate, summed in noise.gauss_markov:
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


def power_law_exponent(effect: Stochastic) -> float | None:
    """Exponent a of a density in fᵃ, from the slope of the Allan deviation or the parameter; None for other processes."""
    if effect.standard is not None:
        return -1.0 - 2.0 * effect.standard.slope
    return effect.values.get("exponent")


def _start_values(
    candidate: Candidate, start: FittedNoise | None, limits: Sequence[tuple[float, float]]
) -> Array:
    """Start values: ln of each variance over that of the first effect, then the exponent if it is fitted.

    Without `start`, all variances are equal and the exponent is in the middle of its range. With a fit `start`, its effects
    keep their variances, and new effects get 1/10 of the largest of them. The exponent, if fitted, starts at that of
    `start`. If `start` has none and ends with B or K, it starts at −1 or −1.8.
    """
    first = np.zeros(len(limits))
    sizes = len(candidate.effects)
    if candidate.exponents is not None:
        first[-1] = np.mean(candidate.exponents)
    if start is not None:
        known = dict(zip(start.candidate.effects, start._parameters.tolist(), strict=False))
        new = max(known.values()) - 2.3
        places = np.array([known.get(effect, new) for effect in candidate.effects])
        first[: sizes - 1] = (places - places[0])[1:]
        if candidate.exponents is not None:
            if start.candidate.exponents is not None:
                first[-1] = start._parameters[-1]
            elif exponent := power_law_exponent(start.candidate.effects[-1]):
                first[-1] = max(exponent, -1.8)
            if sizes > 1 and len(start.candidate.effects) == sizes:
                first[sizes - 2] = float(start._parameters[sizes - 1] - start._parameters[0])
    low, high = np.array(limits).T
    return np.clip(first, low, high)

"""Generalized least squares (GLS) on the overlapping Allan variance, with intervals that are valid near zero."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.fit.likelihood.data import averaging_factors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from allanite.effects.terms import Term

#: Maximum iterations of coefficients and covariance. Chosen by judgment; not measured.
MAX_ROUNDS = 50
#: Maximum relative change of the fitted curve at which the iteration ends. Chosen by judgment; not measured.
CURVE_TOLERANCE = 1e-4
#: Probability in each tail outside a 95 % interval.
TAIL_PROBABILITY = 0.025
#: Maximum iterations of the other coefficients and the covariance that they imply. Chosen by judgment; not measured.
MAX_INTERVAL_ROUNDS = 6
#: Values that are added, one after the other, to the unit diagonal of a correlation matrix until it is positive definite,
#: as in the compiled core. Chosen by judgment; not measured.
DIAGONAL_JITTERS = (1e-9, 1e-7, 1e-5, 1e-3)
#: Number of lowest ordinates that are used one by one. Chosen by judgment; not measured.
SINGLE_ORDINATES = 512
#: Number of sampled frequencies per factor e of frequency above these ordinates. Chosen by judgment; not measured.
FREQUENCIES_PER_E = 400


@dataclass(frozen=True, slots=True, eq=False)
class GlsFit:
    """Result of a GLS fit of a sum of p effects to an Allan curve at k factors.

    `squares`, shape (p,), are the squared coefficients, not negative; rows of their `covariance` for a square at 0 are
    those of the unconstrained solution. `dof` is the number of factors minus number of positive squares. `expected` and
    `target`, shape (k,), are the fitted and the measured Allan variances.
    """

    squares: Array
    covariance: Array
    chi2: float
    dof: int
    expected: Array
    target: Array
    mixtures: Mixtures

    __repr__ = brief

    @property
    def coefficients(self) -> Array:
        """Array of the fitted coefficients √`squares`, shape (p,)."""
        return np.sqrt(self.squares)

    @property
    def std_errors(self) -> Array:
        """Array of the standard errors of `squares` (not of the coefficients), shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    def intervals(self) -> tuple[Array, Array, Array]:
        """Tuple (low, high, p) of arrays with one element for each coefficient: 95 % interval and p-value.

        A p-value is the probability of an estimate at least as large if the coefficient is 0. Where it is at least 0.025,
        low is 0 and high is an upper limit. The p-value of a single coefficient is 0.
        """
        found = [
            _interval(self.mixtures, self.target, self.squares, k) for k in range(self.squares.size)
        ]
        low, high, p_values = np.array(found).T
        return np.sqrt(low), np.sqrt(high), p_values


def gls_factors(n: int) -> NDArray[np.int64]:
    """Averaging factors for a fit to `n` samples: eight per decade, up to a quarter of the record.

    More factors would add no information and make the covariance ill-conditioned.
    """
    return averaging_factors(n // 4)


def fit_gls(
    allan_variances: ArrayLike, factors: ArrayLike, n: int, unit_terms: Sequence[Sequence[Term]]
) -> GlsFit:
    """`GlsFit`: non-negative squared coefficients fitted to an Allan curve by generalized least squares.

    The expected variance is linear in the squares. The covariance of the curve follows from the fitted squares; both are
    computed in turn until they converge. This is Fisher scoring of a Gaussian model of the curve. `allan_variances`, U²,
    are overlapping ones of a record of `n` samples; `factors` are as of `gls_factors`. `unit_terms` are those of each
    effect at coefficient 1. `InputError` if no effect fits the curve or two effects have the same curve, and the errors of
    `_checked_curve`.
    """
    target, m = _checked_curve(allan_variances, factors, len(unit_terms))
    mixtures = Mixtures.of(unit_terms, n, m, target)
    # First guess of the covariance: relative errors grow with the square root of the factor.
    covariance: Array = np.diag(target**2 * m.astype(np.float64))
    squares, spread, chi2 = _kernels.gls_nonnegative(mixtures.columns, target, covariance)
    for _ in range(MAX_ROUNDS):
        before = mixtures.columns @ squares
        if not squares.any():
            raise InputError("no effect of the model fits the curve: all coefficients are 0")
        squares, spread, chi2 = _kernels.gls_nonnegative(
            mixtures.columns, target, mixtures.covariance(squares)
        )
        if np.all(np.abs(mixtures.columns @ squares / before - 1.0) < CURVE_TOLERANCE):
            break
    dof = m.size - int(np.count_nonzero(squares))
    return GlsFit(squares, spread, chi2, dof, mixtures.columns @ squares, target, mixtures)


def _checked_curve(
    allan_variances: ArrayLike, factors: ArrayLike, effects: int
) -> tuple[Array, NDArray[np.int64]]:
    """Pair of arrays: Allan variances as floats and their factors as integers.

    `InputError` for different shapes, variances that are not positive and finite, or no effects; `TooShortError` for fewer
    factors than effects.
    """
    target = np.asarray(allan_variances, dtype=float)
    m = np.asarray(factors, dtype=np.int64)
    if target.ndim != 1 or target.shape != m.shape:
        raise InputError(
            f"Allan variances of shape {target.shape} and factors of shape {m.shape} do not match"
        )
    if not effects:
        raise InputError("the model has no noise: give it at least one effect")
    if m.size < effects:
        raise TooShortError(
            f"{effects} effects need at least as many averaging factors, found {m.size}"
        )
    if not (np.isfinite(target) & (target > 0)).all():
        raise InputError("Allan variances must be positive; remove factors without an estimate")
    return target, m


def _interval(
    mixtures: Mixtures, target: Array, squares: Array, index: int
) -> tuple[float, float, float]:
    """Tuple (low, high, p): 95 % interval of the squared coefficient `index`, valid near zero, and the p-value of 0.

    A value t is inside the interval if the estimate is not improbable under t (test inversion). For each t the other
    coefficients are fitted again, and the covariance is that of the resulting mixture. The estimate follows a gamma
    distribution with its exact variance and the skewness of a sum of squares. Its spread grows with t, which a standard
    error at the estimate ignores. p is the probability of an estimate at least as large if the coefficient is 0. If it is
    at least 0.025, low = 0 and high is an upper limit. With a single coefficient, p is 0.
    """
    test = _TestInversion(mixtures, target, squares, index, squares)
    center = float(squares[index])
    p_zero = 1.0 - test.probability_below(0.0, bounded=False) if squares.size > 1 else 0.0
    above_zero = p_zero < TAIL_PROBABILITY
    low = test.limit_at(center, 0.0, 1.0 - TAIL_PROBABILITY) if above_zero else 0.0
    column = mixtures.columns[:, index]
    outside = max(center, float((target / column).min()) * 1e-3) * 2.0
    for _ in range(60):
        test.trial = squares
        if test.probability_below(outside) < TAIL_PROBABILITY:
            break
        outside *= 2.0
    high = test.limit_at(center, outside, TAIL_PROBABILITY)
    return min(low, center), max(high, center), p_zero


@dataclass(slots=True, eq=False)
class _TestInversion:
    """Probabilities of an estimate under tried values of one squared coefficient; the arguments are those of `_interval`.

    `trial`, shape (p,), are the squared coefficients fitted for the last tried value, from which the next fit starts.
    """

    mixtures: Mixtures
    target: Array
    squares: Array
    index: int
    trial: Array

    def _fitted(self, t: float) -> Array:
        """All squared coefficients if the one at `index` has the value t; the others are fitted, at least 0."""
        columns = self.mixtures.columns
        others = np.delete(np.arange(self.squares.size), self.index)
        trial = self.trial.copy()
        trial[self.index] = t
        left = self.target - t * columns[:, self.index]
        for _ in range(MAX_INTERVAL_ROUNDS if others.size else 0):
            before = trial[others]
            if not trial.any():
                break
            trial[others] = _kernels.gls_nonnegative(
                columns[:, others], left, self.mixtures.covariance(trial)
            )[0]
            moved = columns[:, others] @ np.abs(trial[others] - before)
            if np.all(moved < 1e-3 * (columns @ trial)):
                break
        return trial

    def probability_below(self, t: float, bounded: bool = True) -> float:
        """Probability of a smaller estimate than the measured one, if t is the true squared coefficient.

        The other squared coefficients are fitted for this t and stored in `trial`. With `bounded`, others that are fitted
        as 0 count as known to be 0. If such an effect is present in truth, an upper limit is conservative, but a lower
        limit is too high.
        """
        from scipy.stats import pearson3

        columns, trial = self.mixtures.columns, self._fitted(t)
        if not trial.any():
            return 1.0
        covariance = self.mixtures.covariance(trial)
        scale = np.sqrt(np.diag(covariance))
        white = _cholesky(covariance / np.outer(scale, scale))
        kept = np.flatnonzero((trial > 0.0) | (not bounded) | (np.arange(trial.size) == self.index))
        design = np.linalg.solve(white, columns[:, kept] / scale[:, None])
        norm = np.sqrt((design**2).sum(axis=0))
        inverse = np.linalg.pinv((design / norm).T @ (design / norm), hermitian=True)
        own = int(np.searchsorted(kept, self.index))
        readout = np.linalg.solve(white.T, (design / norm) @ inverse[own]) / scale / norm[own]
        self.trial = trial
        deviation = float(readout @ (self.target - columns @ trial))
        score = deviation / np.sqrt(float(readout @ covariance @ readout))
        # The gamma distribution with mean 0, variance 1 and this skewness, of either sign.
        return float(pearson3.cdf(score, self.mixtures.skewness(trial, readout)))

    def limit_at(self, inside: float, outside: float, probability: float) -> float:
        """Squared coefficient between `inside` and `outside` at which `probability_below` equals `probability`.

        `outside` if `probability_below` does not cross `probability` between the two.
        """
        from scipy.optimize import brentq
        from scipy.special import ndtri

        # As normal score against the square root, the curve is nearly straight.
        level = float(ndtri(probability))

        def score_excess(root: float) -> float:
            """Normal score of `probability_below` at root², clipped to ±9, minus the score of the searched probability."""
            score = float(ndtri(self.probability_below(root**2, bounded=outside > inside)))
            return float(np.clip(score, -9.0, 9.0)) - level

        ends = np.sqrt(inside), np.sqrt(outside)
        if score_excess(ends[0]) * score_excess(ends[1]) >= 0.0:
            return outside
        return float(brentq(score_excess, *ends, rtol=1e-4, xtol=1e-4 * max(ends))) ** 2


def _cholesky(correlation: Array) -> Array:
    """Lower Cholesky factor of a correlation matrix whose diagonal is raised by 1e-9, or by up to 1e-3 if needed."""
    unit = np.eye(correlation.shape[0])
    for jitter in DIAGONAL_JITTERS:
        with suppress(np.linalg.LinAlgError):
            return np.asarray(np.linalg.cholesky(correlation + jitter * unit), dtype=np.float64)
    raise np.linalg.LinAlgError("the correlations of the Allan variances are not positive definite")


def kernel_terms(terms: Sequence[Term], factor: float = 1.0) -> list[tuple[str, list[float]]]:
    """List of (name, parameters) of spectral terms for the compiled core, with variances multiplied by `factor`."""
    return [t.scaled(factor).kernel for t in terms]


@dataclass(frozen=True, slots=True, eq=False)
class Mixtures:
    """Expected Allan variances and covariances at k averaging factors for any mixture of p effects.

    The covariance of the estimates is a quadratic form of the squared coefficients, C(θ) = Σ_ab θ_a θ_b C_ab, because the
    covariance of the differences is linear in them. The p(p+1)/2 parts are computed once, by polarization. A mixture then
    costs only a sum of small matrices, so that least squares can try hundreds of them.

    `columns`, shape (k, p), are the expected Allan variances of each effect at coefficient 1, and `spectra`, shape (f, p),
    its spectrum at sampled frequencies. `parts`, shape (p, p, k, k), are C_ab. `transfer`, shape (f, k), is the weight of
    the power at each sampled frequency in each Allan variance. `weights`, shape (f,), are the ordinates that each frequency
    represents.
    """

    columns: Array
    parts: Array
    transfer: Array
    spectra: Array
    weights: Array

    @classmethod
    def of(
        cls, unit_terms: Sequence[Sequence[Term]], n: int, factors: NDArray[np.int64], around: Array
    ) -> Mixtures:
        """`Mixtures` of p effects, given by their terms at coefficient 1, at the averaging `factors`, for n samples.

        `around`, shape (k,), holds the measured variances. Each effect is scaled so that it alone reaches one of them,
        because small parts of the covariance would otherwise be lost in rounding.
        """
        p = len(unit_terms)
        columns = np.column_stack(
            [_kernels.allan_variances(kernel_terms(t), n, factors)[0] for t in unit_terms]
        )
        scale = (around[:, None] / columns).min(axis=0)
        parts = np.empty((p, p, factors.size, factors.size))
        for a in range(p):
            mine = kernel_terms(unit_terms[a], float(scale[a]))
            parts[a, a] = _kernels.allan_covariance(mine, n, factors)[1]
            for b in range(a):
                other = kernel_terms(unit_terms[b], float(scale[b]))
                both = _kernels.allan_covariance(mine + other, n, factors)[1]
                parts[a, b] = parts[b, a] = (both - parts[a, a] - parts[b, b]) / 2.0
        parts /= np.multiply.outer(scale, scale)[:, :, None, None]
        # All ordinates at the slow end, then a sample of them, since transfer functions are smooth on average.
        last = n - 1
        j = np.arange(1, min(SINGLE_ORDINATES, last) + 1, dtype=np.float64)
        weights = np.ones(j.size)
        if last > SINGLE_ORDINATES:
            count = int(FREQUENCIES_PER_E * np.log(last / SINGLE_ORDINATES)) + 2
            edges = np.geomspace(SINGLE_ORDINATES + 0.5, last + 0.5, count)
            edges = np.unique(np.round(edges))
            weights = np.concatenate([weights, np.diff(edges)])
            j = np.concatenate([j, (edges[1:] + edges[:-1]) / 2.0])
        w = np.pi * j / n
        one, mean = np.sin(w / 2.0)[:, None], np.sin(np.multiply.outer(w / 2.0, factors))
        transfer = 2.0 * mean**4 / (one * factors) ** 2 / n
        spectra = np.column_stack(
            [np.sum([t.spectrum(w) for t in terms], axis=0) for terms in unit_terms]
        )
        return cls(columns, parts, transfer, spectra, weights)

    def covariance(self, squares: Array) -> Array:
        """Array of the covariance of estimated Allan variances, shape (k, k), for squared coefficients of shape (p,)."""
        return np.asarray(np.einsum("a,b,abij->ij", squares, squares, self.parts))

    def skewness(self, squares: Array, readout: Array) -> float:
        """Skewness of the sum of estimated Allan variances with the weights `readout`, shape (k,); 0 without variance.

        It is a weighted sum of squares of nearly independent ordinates: κ3/κ2^{3/2} with κ_q ∝ Σ (S H)^q.
        """
        x = (self.spectra @ squares) * (self.transfer @ readout)
        second = float(self.weights @ x**2)
        return float(np.sqrt(8.0) * (self.weights @ x**3) / second**1.5) if second > 0 else 0.0

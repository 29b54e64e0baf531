"""Generalized least squares (GLS) on the overlapping Allan variance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.fit.classical.gls_intervals import interval
from allanite.fit.classical.mixtures import Mixtures
from allanite.fit.likelihood.data import averaging_factors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from allanite.effects.terms import Term

#: Maximum iterations of coefficients and covariance. Chosen by judgment; not measured.
MAX_ROUNDS = 50
#: Maximum relative change of the fitted curve at which the iteration ends. Chosen by judgment; not measured.
CURVE_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class GlsFit:
    """Result of a GLS fit of a sum of effects to an Allan curve.

    Attributes
    ----------
    squares : ndarray, shape (p,)
        Squared coefficients, not negative.
    covariance : ndarray, shape (p, p)
        Covariance of `squares`. Rows of a square at 0 are those of the unconstrained solution.
    chi2 : float
        χ² of the whole curve with its covariance.
    dof : int
        Number of factors minus number of positive squares.
    expected : ndarray, shape (k,)
        Fitted Allan variances.
    target : ndarray, shape (k,)
        Measured Allan variances.
    mixtures : Mixtures
        Expected variances and covariances for any squared coefficients.
    """

    squares: Array
    covariance: Array
    chi2: float
    dof: int
    expected: Array
    target: Array
    mixtures: Mixtures

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("squares", "covariance", "expected"):
            getattr(self, name).flags.writeable = False

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

        A p-value is the probability of an estimate at least as large if the coefficient is 0. Where it is at least
        0.025, low is 0 and high is an upper limit. The p-value of a single coefficient is 0.
        """
        found = [
            interval(self.mixtures, self.target, self.squares, k) for k in range(self.squares.size)
        ]
        low, high, p_values = np.array(found).T
        return np.sqrt(low), np.sqrt(high), p_values


def gls_factors(n: int) -> NDArray[np.int64]:
    """Array of averaging factors for a fit to `n` samples: eight per decade, up to a quarter of the record.

    More factors would add no information and make the covariance ill-conditioned.
    """
    return averaging_factors(n // 4)


def fit_gls(
    allan_variances: ArrayLike, factors: ArrayLike, n: int, unit_terms: Sequence[Sequence[Term]]
) -> GlsFit:
    """`GlsFit`: non-negative squared coefficients fitted to an Allan curve by generalized least squares.

    The expected variance is linear in the squares. The covariance of the curve follows from the fitted squares; both are
    computed in turn until they converge. This is Fisher scoring of a Gaussian model of the curve.

    Parameters
    ----------
    allan_variances : array_like, shape (k,)
        Measured overlapping Allan variances, U².
    factors : array_like of int, shape (k,)
        Their averaging factors; see `gls_factors`.
    n : int
        Samples of the record.
    unit_terms : sequence of p sequences of terms
        Primitive terms of each effect with its coefficient 1, per sample.

    Returns
    -------
    GlsFit

    Raises
    ------
    InputError
        Non-positive variances, effects with the same curve, arrays of different shapes, or all coefficients 0.
    TooShortError
        Fewer factors than effects.
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
    """Pair of arrays: Allan variances as floats and their factors as integers, after the checks of `fit_gls`.

    Raises `InputError` for different shapes, variances that are not positive or no effects; `TooShortError` for fewer
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

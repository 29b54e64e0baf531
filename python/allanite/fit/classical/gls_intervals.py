"""Confidence intervals of squared coefficients from Allan variances, valid near zero.

A value t is inside the interval if the estimate is not improbable under t (test inversion). For each t the other
coefficients are fitted again, and the covariance is that of the resulting mixture. The estimate follows a gamma
distribution with its exact variance and the skewness of a sum of squares. Its spread grows with t, which a standard error
at the estimate ignores.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array

if TYPE_CHECKING:
    from allanite.fit.classical.mixtures import Mixtures


#: Probability in each tail outside a 95 % interval.
TAIL_PROBABILITY = 0.025
#: Maximum iterations of the other coefficients and the covariance that they imply. Chosen by judgment; not measured.
MAX_ROUNDS = 6
#: Values that are added, one after the other, to the unit diagonal of a correlation matrix until it is positive definite,
#: as in the compiled core. Chosen by judgment; not measured.
DIAGONAL_JITTERS = (1e-9, 1e-7, 1e-5, 1e-3)


def interval(
    mixtures: Mixtures, target: Array, squares: Array, index: int
) -> tuple[float, float, float]:
    """Tuple (low, high, p) with the 95 % interval of one squared coefficient.

    Parameters
    ----------
    mixtures : Mixtures
    target : ndarray, shape (k,)
        Measured Allan variances.
    squares : ndarray, shape (p,)
        The estimate.
    index : int
        Index of the coefficient.

    Returns
    -------
    tuple of float
        (low, high, p): limits of the square, and the probability p of an estimate at least as large if the coefficient
        is 0. If p ≥ 0.025, low = 0 and high is an upper limit. With a single coefficient, p is 0.
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
    """Probabilities of an estimate under tried values of one squared coefficient.

    Attributes
    ----------
    mixtures, target, squares, index
        See `interval`.
    trial : ndarray, shape (p,)
        Squared coefficients fitted for the last tried value, from which the next fit starts.
    """

    mixtures: Mixtures
    target: Array
    squares: Array
    index: int
    trial: Array

    def _fitted(self, t: float) -> Array:
        """Array of all squared coefficients if the one at `index` has the value t; the others are fitted, at least 0.

        Covariance and fit are iterated at most six times.
        """
        columns = self.mixtures.columns
        others = np.delete(np.arange(self.squares.size), self.index)
        trial = self.trial.copy()
        trial[self.index] = t
        left = self.target - t * columns[:, self.index]
        for _ in range(MAX_ROUNDS if others.size else 0):
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
        """Probability that a record yields a smaller estimate than the measured one, if t is the true squared coefficient.

        The other squared coefficients are fitted for this t and stored in `trial`. If all, including t, are 0, the
        probability is 1 and nothing is stored. With `bounded`, others that are fitted as 0 count as known to be 0. If such
        an effect is present in truth, an upper limit is conservative, but a lower limit is too high.
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

        Returns `outside` if `probability_below` does not cross `probability` between the two.
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
    """Array: lower Cholesky factor of a correlation matrix whose diagonal is raised by 1e-9, or by more if needed.

    If that fails, 1e-7, 1e-5 and 1e-3 are tried. LinAlgError if none suffices.
    """
    unit = np.eye(correlation.shape[0])
    for jitter in DIAGONAL_JITTERS:
        with suppress(np.linalg.LinAlgError):
            return np.asarray(np.linalg.cholesky(correlation + jitter * unit), dtype=np.float64)
    raise np.linalg.LinAlgError("the correlations of the Allan variances are not positive definite")

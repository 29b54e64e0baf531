"""Confidence bands of a measured deviation under known noise, with exact degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.showing import brief

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from allanite.effects.terms import Term

#: Equivalent degrees of freedom below which the exact distribution (eigenvalues of the differences) is used, because a χ²
#: distribution of the same variance has visibly the wrong shape. Chosen by judgment; not measured.
MAX_EXACT_EDF = 40.0
#: Number of random draws for the simultaneous band; its level then has a standard error of √(0.95·0.05/20000) = 0.15 %.
BAND_DRAWS = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Factors, shape (k,), that convert a measured deviation into 95 % intervals of the true deviation.

    `low_factor` and `high_factor` are for each τ separately, `low_everywhere` and `high_everywhere` for all τ together.
    `edf` are the exact equivalent degrees of freedom 2σ⁴/var(σ̂²).
    """

    low_factor: Array
    high_factor: Array
    low_everywhere: Array
    high_everywhere: Array
    edf: Array

    __repr__ = brief


def bands(terms: Sequence[Term], n: int, factors: ArrayLike, kind: str = "oadev") -> Bands:
    """`Bands`: factors for pointwise and simultaneous 95 % intervals of a deviation whose noise is known.

    Each variance estimate is a sum of squares of Gaussian random numbers. With many equivalent degrees of freedom it is
    treated as χ², with few as a sum weighted by eigenvalues. The simultaneous band is a pointwise band at a higher level.
    At this level all correlated estimates stay inside together with the probability 95 %.

    `n` is the number of samples of the record, `factors`, shape (k,), are averaging factors. The estimator `kind` is
    "oadev", "mdev", "hdev" or "totdev". The latter is that of NIST SP 1065 eq. 25, without division by the published bias;
    the factors correct the bias under the given noise instead. `InputError` for an unknown term or
    kind. `TooShortError` for a factor too large for a complete difference.
    """
    plain = [t.kernel for t in terms]
    m = np.atleast_1d(np.asarray(factors, dtype=np.int64))
    expected, covariance = _kernels.allan_covariance(plain, n, m, kind)
    variance = np.diag(covariance)
    edf = 2.0 * expected**2 / variance
    together = _simultaneous_tail(covariance / np.sqrt(np.outer(variance, variance)))
    probabilities = [0.025, 0.975, together, 1.0 - together]
    low, high = np.empty((2, m.size)), np.empty((2, m.size))
    bias = np.ones(m.size) if kind != "totdev" else expected / expected_variance(terms, m)
    for k, freedom in enumerate(edf):
        q = bias[k] * _quantiles(plain, n, int(m[k]), float(freedom), probabilities, kind)
        high[:, k], low[:, k] = 1.0 / np.sqrt(q[0::2]), 1.0 / np.sqrt(q[1::2])
    return Bands(low[0], high[0], low[1], high[1], edf)


def expected_variance(terms: Sequence[Term], factors: NDArray[np.int64]) -> Array:
    """Array of the expected Allan variance of a sum of spectral terms at each averaging factor, U², shape (k,)."""
    m = factors.astype(float)
    return np.asarray(sum((t.allan_variance(m) for t in terms), np.zeros(m.size)))


def degrees_of_freedom(terms: Sequence[Term], n: int, factors: ArrayLike) -> Array:
    """Exact equivalent degrees of freedom 2σ⁴/var(σ̂²) of an overlapping Allan variance at `factors`, shape (k,)."""
    plain = [t.kernel for t in terms]
    m = np.atleast_1d(np.asarray(factors, dtype=np.int64))
    expected, variance = _kernels.allan_variances(plain, n, m)
    return np.asarray(2.0 * expected**2 / variance)


def _quantiles(
    terms: list[tuple[str, list[float]]],
    n: int,
    factor: int,
    edf: float,
    probabilities: list[float],
    kind: str,
) -> Array:
    """Quantiles, at `probabilities`, of the ratio of estimated to true variance at one averaging `factor`.

    For `edf` below 40 the exact distribution of the sum of squares is used. Otherwise, and for quantization alone, it is
    that of χ².
    """
    from scipy.special import gammaincinv

    if edf < MAX_EXACT_EDF and any(name != "blue" for name, _ in terms):
        return _kernels.allan_law(terms, n, factor, probabilities, kind)
    return np.asarray(gammaincinv(edf / 2.0, probabilities), dtype=np.float64) * (2.0 / edf)


def _simultaneous_tail(correlation: Array) -> float:
    """Tail probability at each end of pointwise intervals that hold together with probability 95 %.

    The value comes from 20 000 normal draws with a fixed seed.
    """
    from scipy.special import ndtr

    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = np.random.default_rng(0).standard_normal((BAND_DRAWS, correlation.shape[0]))
    largest = np.abs(draws @ root.T).max(axis=1)
    return float(ndtr(-np.quantile(largest, 0.95)))

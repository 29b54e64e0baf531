"""Allan variances and variograms of exponentials and power laws, from sums over lags or closed forms."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.common.memory import cleared_by_free_buffers
from allanite.effects._declared import Array

#: Maximum averaging factor m for which the Allan variance is a sum over lags. Above it, closed forms lose no digits.
#: Chosen by judgment; not measured.
MAX_DIRECT_FACTOR = 256


def allan_of_lags(covariance: Array, m: int) -> float:
    """Allan variance at averaging factor m of a process with autocovariance r(0), r(1), …, and 0 beyond the given lags.

    It is (4V(m) − V(2m))/(2m²) with V(m) = Σ_{|h|<m} (m−|h|) r(h).
    """

    def total(width: int) -> float:
        """Variance V of a sum of `width` samples."""
        lags = np.arange(min(width, covariance.size))
        weights = np.where(lags == 0, 1.0, 2.0) * (width - lags)
        return float(weights @ covariance[: lags.size])

    return (4.0 * total(m) - total(2 * m)) / (2.0 * m * m)


def allan_of_variogram(variogram: Array, m: NDArray[np.int64]) -> Array:
    """Allan variance at averaging factors m from the variogram r(0) − r(h) at lags 0, 1, … 2·max(m) − 1.

    The variogram has no cancellation, unlike the autocovariance r(h).
    """
    sums, moments = np.cumsum(variogram), np.cumsum(np.arange(variogram.size) * variogram)
    double = 2 * m * sums[2 * m - 1] - moments[2 * m - 1]
    return np.asarray((2 * double - 8 * (m * sums[m - 1] - moments[m - 1])) / (2.0 * m**2))


def exponential_allan(a: complex, phi: complex, m: Array) -> Array:
    """Allan variance at averaging factors m of a process with autocovariance r(h) = Re(a φ^h), shape of m.

    Up to m = 256 it is a sum over lags, above the closed form Re a[m−3φ−mφ²+4φ^{m+1}−φ^{2m+1}]/[m²(1−φ)²]. The closed
    form loses all digits for m(1−φ) → 0. There the process is a random walk of step variance 2 Re(a(1−φ)).
    """
    out = np.empty(np.shape(m))
    m = np.asarray(m)
    small = m <= MAX_DIRECT_FACTOR
    log_phi = np.log(phi) if phi != 0 else complex(-1e4)
    if small.any():
        k = m[small].astype(np.int64)
        out[small] = allan_of_variogram(-(a * np.expm1(np.arange(2 * k.max()) * log_phi)).real, k)
    large = ~small
    if large.any():
        k = m[large].astype(np.longdouble)
        p, x = np.clongdouble(phi), np.clongdouble(-np.expm1(log_phi))
        pm = np.exp(k * np.clongdouble(log_phi))
        value = np.clongdouble(a) * (
            k * x * (1 + p) - 3 * p + p * p + 4 * p * pm - p * pm**2 - p**2
        )
        # m(1−φ²) − 3φ + 4φ^{m+1} − φ^{2m+1}, over m²(1−φ)².
        with np.errstate(invalid="ignore"):  # if φ rounds to 1, the random walk is used
            closed = (value / (k * x) ** 2).real.astype(float)
        walk = 2.0 * (a * complex(x)).real * (2.0 * m[large] ** 2 + 1.0) / (6.0 * m[large])
        out[large] = np.where(np.abs(complex(x)) * m[large] > 1e-4, closed, walk)
    return out


@cleared_by_free_buffers
@lru_cache(maxsize=256)
def power_law_lags(exponent: float, count: int) -> Array:
    """Variogram r(0) − r(h) of the spectrum (2 sin(w/2))^exponent at lags h = 0 … count−1; cached.

    Fractional noise of order d = −exponent/2 (Hosking 1981) has r(h) = Γ(1−2d)Γ(h+d)/(Γ(d)Γ(1−d)Γ(h+1−d)). The formula
    is continued beyond d = ½, where only differences of r exist. At d = ½ the variogram is (2/π) Σ 1/(2k−1) over k = 1
    … h.
    """
    h = np.arange(count)
    if abs(exponent + 1.0) < 1e-6:
        return np.concatenate([[0.0], np.cumsum(1.0 / (2.0 * h[1:] - 1.0))]) * (2.0 / np.pi)
    if abs(exponent + 2.0) < 1e-6:
        return h / 2.0
    if abs(exponent) < 1e-9:
        return (h > 0).astype(float)
    from scipy.special import gamma

    d = -exponent / 2.0
    ratio = np.concatenate([[1.0], np.cumprod((h[1:] - 1 + d) / (h[1:] - d))])
    return np.asarray(gamma(1 - 2 * d) / gamma(1 - d) ** 2 * (1.0 - ratio))


def power_law_allan(exponent: float, m: Array) -> Array:
    """Allan variance of noise with the spectrum (2 sin(w/2))^exponent at averaging factors m, shape of m.

    It is exact up to m = 1024. Above, it is the sum of the two leading powers of m, fitted at m = 512 and 1024.
    """
    m = np.asarray(m, dtype=float)
    reference = 4 * MAX_DIRECT_FACTOR
    variogram = power_law_lags(round(exponent, 9), 2 * reference)
    small = m <= reference
    out = np.empty(m.shape)
    out[small] = allan_of_variogram(variogram, m[small].astype(np.int64))
    # Above, the variance is a power of m with a correction m^{a−1} (or m^{−2} from the discrete sampling).
    second = max(exponent - 1.0, -2.0)
    top = np.array([reference // 2, reference])
    scaled_top = allan_of_variogram(variogram, top) * top ** (1.0 + exponent)

    def second_term(k: Array) -> Array:
        """Array of k^(exponent − 1) or k⁻², the larger; ln k if the exponent is 1."""
        # If both powers are equal, the second one gets a logarithm (flicker PM).
        return np.log(k) if second == 0.0 else k**second

    ends = second_term(top.astype(float))
    bend = (scaled_top[0] - scaled_top[1]) / (ends[0] - ends[1])
    limit = scaled_top[1] - bend * ends[1]
    large = ~small
    out[large] = (limit + bend * second_term(m[large])) * m[large] ** (-1.0 - exponent)
    return out


@cleared_by_free_buffers
@lru_cache(maxsize=256)
def power_law_ends(exponent: float, n: int) -> tuple[float, ...]:
    """Leakage ratios E c_j²/s(w_j) of a power law at the cosine ordinates j = 1 … 64 of n samples; cached.

    Without leakage a ratio is 1. The ratios of n above 2048 are taken from n = 2048, with an error of 1e-4. For n below
    65 there are n − 1 ratios.
    """
    n = min(n, 2048)
    j = np.arange(1, min(n, 65))
    own = _cosine_weights(n) @ power_law_lags(exponent, n)[1:]
    return tuple((-(2.0 / n) * own / (2 * np.sin(np.pi * j / (2 * n))) ** exponent).tolist())


@cleared_by_free_buffers
@lru_cache(maxsize=4)
def _cosine_weights(n: int) -> Array:
    """(n − h) cos(ah) − sin(ah)/sin(a): weights of lags h (columns) in the expected square of ordinates j (rows); cached.

    a = πj/n. The rows are j = 1 … 64, or to n − 1 for shorter records; the columns are the lags h = 1 … n − 1.
    """
    h = np.arange(1, n)
    angle = np.pi * np.arange(1, min(n, 65))[:, None] / n
    return np.asarray((n - h) * np.cos(angle * h) - np.sin(angle * h) / np.sin(angle))

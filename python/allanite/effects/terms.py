"""Primitive random processes, of which every stochastic effect is a sum.

A *term* is a name and numbers *per sample* (spacing 1), so that the same short list serves the spectrum,
the Allan variance, the covariance of the estimates and the simulation:

| term | numbers | autocovariance r(h) or spectrum s(w), w = 2πfτ0 |
|---|---|---|
| ``white`` | variance | r(0) |
| ``blue`` | variance v | x_k = w_{k+1} − w_k; s = 4 v sin²(w/2) |
| ``random_walk`` | step variance v | s = v/(4 sin²(w/2)) |
| ``flicker`` | B² | s = B²/(2 sin(w/2)) |
| ``power_law`` | exponent a, level² L | s = L (2 sin(w/2))^a |
| ``exponential`` | Re a, Im a, Re φ, Im φ | r(h) = Re(a φ^h) |
| ``lags`` | r(0), r(1), …, r(L) | what they say, 0 beyond: a filter that ends |

A two-sided density in U²/Hz is s(w)·τ0.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["Term", "allan_variance", "cosine_variance", "scaled", "spectrum", "variogram"]

Array = NDArray[np.float64]
Term = tuple[str, tuple[float, ...]]

# Sums over lags are done term by term up to here; beyond, closed forms no longer lose digits.
DIRECT = 256


def scaled(term: Term, factor: float) -> Term:
    """The same process with its variance multiplied by `factor`."""
    name, v = term
    if name == "exponential":
        return name, (v[0] * factor, v[1] * factor, v[2], v[3])
    if name == "power_law":
        return name, (v[0], v[1] * factor)
    return name, tuple(value * factor for value in v)


def spectrum(term: Term, w: Array) -> Array:
    """Spectrum s(w) of a term at angular frequencies `w` in (0, π] per sample; shape of `w`."""
    name, v = term
    if name == "white":
        return np.full_like(w, v[0])
    half = 2.0 * np.sin(w / 2.0)
    if name == "blue":
        return v[0] * half**2
    if name == "random_walk":
        return v[0] / half**2
    if name == "flicker":
        return v[0] / half
    if name == "power_law":
        return np.asarray(v[1] * half ** v[0])
    if name == "exponential":
        a, phi = complex(v[0], v[1]), complex(v[2], v[3])
        # 1 − 2φ cos w + φ² written so that φ → 1, w → 0 keeps its digits.
        return np.asarray((a * (1 - phi**2) / ((1 - phi) ** 2 + phi * half**2)).real)
    if name == "lags":
        series = [v[0], *(2.0 * r for r in v[1:])]
        return np.asarray(np.polynomial.chebyshev.chebval(np.cos(w), series))
    raise AssertionError(name)


def allan_variance(term: Term, m: Array) -> Array:
    """Exact Allan variance of a term at integer averaging factors `m`; shape of `m`."""
    name, v = term
    if name == "white":
        return v[0] / m
    if name == "blue":
        return 3.0 * v[0] / m**2
    if name == "random_walk":
        return v[0] * (2.0 * m**2 + 1.0) / (6.0 * m)
    if name == "flicker":
        return v[0] * _power_law_allan(-1.0, m)
    if name == "power_law":
        return v[1] * _power_law_allan(v[0], m)
    if name == "exponential":
        return _exponential_allan(complex(v[0], v[1]), complex(v[2], v[3]), m)
    if name == "lags":
        return np.array([_allan_of_lags(np.array(v), int(k)) for k in m])
    raise AssertionError(name)


def _allan_of_lags(covariance: Array, m: int) -> float:
    """(4V(m) − V(2m))/(2m²), V(m) = Σ_{|h|<m} (m−|h|) r(h), for r that ends after a few lags."""

    def total(width: int) -> float:
        lags = np.arange(min(width, covariance.size))
        weights = np.where(lags == 0, 1.0, 2.0) * (width - lags)
        return float(weights @ covariance[: lags.size])

    return (4.0 * total(m) - total(2 * m)) / (2.0 * m * m)


def _exponential_allan(a: complex, phi: complex, m: Array) -> Array:
    """Allan variance of r(h) = Re(a φ^h): exact lag sums for small m, the closed form above.

    METHODS: σ² = s²[m−3φ−mφ²+4φ^{m+1}−φ^{2m+1}]/[m²(1−φ)²(1−φ²)] loses all digits for m(1−φ) → 0;
    there the process is a random walk of step variance 2 Re(a(1−φ)).
    """
    out = np.empty(np.shape(m))
    m = np.asarray(m)
    small = m <= DIRECT
    log_phi = np.log(phi) if phi != 0 else complex(-1e4)
    if small.any():
        h = np.arange(2 * int(m[small].max()))
        # Second differences see only the variogram g(h) = r(0) − r(h), free of cancellation.
        g = -(a * np.expm1(h * log_phi)).real
        s0, s1 = np.cumsum(g), np.cumsum(h * g)
        k = m[small].astype(int)
        out[small] = (
            2 * (2 * k * s0[2 * k - 1] - s1[2 * k - 1]) - 8 * (k * s0[k - 1] - s1[k - 1])
        ) / (2.0 * k**2)
    large = ~small
    if large.any():
        k = m[large].astype(np.longdouble)
        p, x = np.clongdouble(phi), np.clongdouble(-np.expm1(log_phi))
        pm = np.exp(k * np.clongdouble(log_phi))
        value = np.clongdouble(a) * (
            k * x * (1 + p) - 3 * p + p * p + 4 * p * pm - p * pm**2 - p**2
        )
        # m(1−φ²) − 3φ + 4φ^{m+1} − φ^{2m+1}, over m²(1−φ)².
        closed = (value / (k * x) ** 2).real.astype(float)
        walk = 2.0 * (a * complex(x)).real * (2.0 * m[large] ** 2 + 1.0) / (6.0 * m[large])
        out[large] = np.where(np.abs(complex(x)) * m[large] > 1e-4, closed, walk)
    return out


@lru_cache(maxsize=256)
def _power_law_lags(exponent: float, count: int) -> Array:
    """Variogram r(0) − r(h) of the spectrum (2 sin(w/2))^a, h = 0…count−1.

    Fractional noise of order d = −a/2 (Hosking 1981): r(h) = Γ(1−2d)Γ(h+d)/(Γ(d)Γ(1−d)Γ(h+1−d)), continued
    beyond d = ½, where only differences of r have a meaning. At d = ½ it is (2/π) Σ 1/(2k−1).
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


def _power_law_allan(exponent: float, m: Array) -> Array:
    """Allan variance of (2 sin(w/2))^a: exact to 4·DIRECT, then its two leading powers of m."""
    m = np.asarray(m, dtype=float)
    reference = 4 * DIRECT
    g = _power_law_lags(round(exponent, 9), 2 * reference)
    h = np.arange(g.size)
    s0, s1 = np.cumsum(g), np.cumsum(h * g)

    def exact(k: NDArray[np.int64]) -> Array:
        return np.asarray(
            (2 * (2 * k * s0[2 * k - 1] - s1[2 * k - 1]) - 8 * (k * s0[k - 1] - s1[k - 1]))
            / (2.0 * k**2)
        )

    small = m <= reference
    out = np.empty(m.shape)
    out[small] = exact(m[small].astype(np.int64))
    # Beyond, V(m) = A m^{1−a} + D + …: a second power m^{a−1} (or the discreteness, m^{−2}) beside the first.
    second = max(exponent - 1.0, -2.0)
    top = np.array([reference // 2, reference])
    scaled_top = exact(top) * top ** (1.0 + exponent)
    bend = (scaled_top[0] - scaled_top[1]) / (float(top[0]) ** second - float(top[1]) ** second)
    limit = scaled_top[1] - bend * float(top[1]) ** second
    large = ~small
    out[large] = (limit + bend * m[large] ** second) * m[large] ** (-1.0 - exponent)
    return out


@lru_cache(maxsize=256)
def _power_law_ends(exponent: float, n: int) -> Array:
    """E c_j²/s(w_j) of a power law at j = 1…64 of n ordinates: what the ends of the record do to it."""
    j = np.arange(1, min(n, 65))
    lags = _power_law_lags(exponent, n)
    h = np.arange(1, n)
    angle = np.pi * j[:, None] / n
    weights = (n - h) * np.cos(angle * h) - np.sin(angle * h) / np.sin(angle)
    return np.asarray(
        -(2.0 / n) * (weights @ lags[1:]) / (2 * np.sin(np.pi * j / (2 * n))) ** exponent
    )


def cosine_variance(term: Term, j: NDArray[np.int64], n: int) -> Array:
    """Exact expectation of the squared cosine-transform ordinate c_j of n samples; shape of `j`.

    For white noise and random walks this *is* the spectrum at w = πj/n. For the others the ends of the record
    add a little: r(h) contributes r(0) + (2/n) Σ_h r(h)[(n−h) cos(ah) − sin(ah)/sin(a)], a = πj/n.
    """
    name, v = term
    w = np.pi * j / n
    plain = spectrum(term, w)
    if name == "blue":
        return plain + v[0] * (4.0 / n) * np.cos(w / 2) ** 2
    if name in {"flicker", "power_law"}:
        exponent = -1.0 if name == "flicker" else round(v[0], 6)
        # The correction depends on j alone once n is large; 2048 samples show it to 1e-4.
        ends = _power_law_ends(exponent, min(n, 2048))
        ratio = np.interp(j, np.arange(1, ends.size + 1), ends)
        beyond = j > ends.size
        ratio[beyond] = 1.0 + (ends[-1] - 1.0) * ends.size / j[beyond]
        return plain * ratio
    if name == "exponential":
        return _exponential_cosine(complex(v[0], v[1]), complex(v[2], v[3]), w, n)
    if name == "lags":
        # Without the ends the zeros of the filter would be deeper than any record shows them.
        lags = np.array(v[1:n])
        c = np.cos(w)
        own, ends = 2.0 * lags, -(2.0 / n) * np.arange(1, lags.size + 1) * lags
        plain = v[0] + c * 0.0
        if lags.size:
            plain = np.polynomial.chebyshev.chebval(c, [v[0], *(own + ends)])
            # Σ r(h) sin(hw)/sin(w): second-kind polynomials, by Clenshaw's recurrence.
            here, after = np.zeros(c.size), np.zeros(c.size)
            for r in lags[::-1]:
                here, after = r + 2.0 * c * here - after, here
            plain = plain - (2.0 / n) * here
        return np.asarray(plain)
    return plain


def _exponential_cosine(a: complex, phi: complex, w: Array, n: int) -> Array:
    """Geometric sums of the formula in `cosine_variance` for r(h) = Re(a φ^h)."""
    tail = phi**n
    sign = np.where(np.round(w * n / np.pi).astype(np.int64) % 2 == 0, 1.0, -1.0)

    def sums(z: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        end = tail * sign  # z^n: e^{±iwn} = (−1)^j
        plain = (z - end) / (1 - z)
        weighted = (z - n * end + (n - 1) * end * z) / (1 - z) ** 2
        return plain, weighted

    up, down = sums(phi * np.exp(1j * w)), sums(phi * np.exp(-1j * w))
    cosines = n * (up[0] + down[0]) / 2 - (up[1] + down[1]) / 2
    sines = (up[0] - down[0]) / 2j
    return np.asarray((a * (1 + (2.0 / n) * (cosines - sines / np.sin(w)))).real)


def variogram(term: Term, count: int) -> Array:
    """½ E(x(k+h) − x(k))² of a term at h = 0 … count − 1, shape (count,)."""
    name, v = term
    h = np.arange(count)
    if name == "white":
        return np.asarray(v[0] * (h > 0).astype(float))
    if name == "blue":
        return np.asarray(v[0] * np.where(h == 1, 3.0, np.where(h == 0, 0.0, 2.0)))
    if name == "random_walk":
        return np.asarray(v[0] * h / 2.0)
    if name == "flicker":
        return v[0] * _power_law_lags(-1.0, count)
    if name == "power_law":
        return v[1] * _power_law_lags(v[0], count)
    if name == "exponential":
        a, phi = complex(v[0], v[1]), complex(v[2], v[3])
        log_phi = np.log(phi) if phi != 0 else complex(-1e4)
        return np.asarray(-(a * np.expm1(h * log_phi)).real)
    if name == "lags":
        return v[0] - np.pad(v, (0, count))[:count]
    raise AssertionError(name)

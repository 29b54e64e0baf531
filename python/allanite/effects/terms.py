"""Primitive random processes, of which every stochastic effect is a sum.

A term holds its numbers *per sample* (spacing 1), so that the same short list serves the spectrum, the Allan variance,
the covariance of the estimates and the simulation:

| term | numbers | autocovariance r(h) or spectrum s(w), w = 2πfτ0 |
|---|---|---|
| `White` | variance | r(0) |
| `Blue` | variance v | x_k = w_{k+1} − w_k; s = 4 v sin²(w/2) |
| `RandomWalk` | step variance v | s = v/(4 sin²(w/2)) |
| `Flicker` | B² | s = B²/(2 sin(w/2)) |
| `PowerLaw` | exponent a, level² L | s = L (2 sin(w/2))^a |
| `Exponential` | complex a, φ | r(h) = Re(a φ^h) |
| `MovingAverage` | variance v, length L | white of variance v through a boxcar mean of L samples |

A two-sided density in U²/Hz is s(w)·τ0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Blue",
    "Exponential",
    "Flicker",
    "MovingAverage",
    "PowerLaw",
    "RandomWalk",
    "Term",
    "White",
]

Array = NDArray[np.float64]

# Sums over lags are done term by term up to here; beyond, closed forms no longer lose digits.
DIRECT = 256


@dataclass(frozen=True)
class Term:
    """A primitive process."""

    #: Its name in the core.
    name: ClassVar[str]

    @property
    def numbers(self) -> tuple[float, ...]:
        """Its numbers in the order in which the core takes them."""
        raise NotImplementedError

    @property
    def kernel(self) -> tuple[str, list[float]]:
        """What crosses into the core."""
        return self.name, list(self.numbers)

    @property
    def power(self) -> float | None:
        """Variance of a sample; None, as here, where it grows with the record."""
        return None

    def scaled(self, factor: float) -> Self:
        """The same process with its variance multiplied by `factor`."""
        raise NotImplementedError

    def spectrum(self, w: Array) -> Array:
        """Spectrum s(w) at angular frequencies `w` in (0, π] per sample; shape of `w`."""
        raise NotImplementedError

    def allan_variance(self, m: Array) -> Array:
        """Exact Allan variance at integer averaging factors `m`; shape of `m`."""
        raise NotImplementedError

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """Exact expectation of the squared cosine-transform ordinate c_j of n samples; shape of `j`.

        For white noise and random walks this *is* the spectrum at w = πj/n. For the others the ends of the record
        add a little: r(h) contributes r(0) + (2/n) Σ_h r(h)[(n−h) cos(ah) − sin(ah)/sin(a)], a = πj/n.
        """
        return self.spectrum(np.pi * j / n)

    def variogram(self, count: int) -> Array:
        """½ E(x(k+h) − x(k))² at h = 0 … count − 1, shape (count,)."""
        raise NotImplementedError

    @property
    def generator(self) -> tuple[str, list[float]] | None:
        """The core's generator and its numbers; None where it needs a filter of its own."""
        raise NotImplementedError


@dataclass(frozen=True)
class _Sized(Term):
    """A term of one variance."""

    variance: float

    @property
    def numbers(self) -> tuple[float, ...]:
        """The variance."""
        return (self.variance,)

    def scaled(self, factor: float) -> Self:
        """The variance times `factor`."""
        return replace(self, variance=self.variance * factor)

    @property
    def generator(self) -> tuple[str, list[float]]:
        """Its name and standard deviation."""
        return self.name, [float(np.sqrt(self.variance)), *self.numbers[1:]]


def _step(w: Array) -> Array:
    """2 sin(w/2): the size of a difference's transfer function."""
    return np.asarray(2.0 * np.sin(w / 2.0))


class White(_Sized):
    """Independent samples; beside an exponential its variance may be negative."""

    name = "white"

    @property
    def power(self) -> float:
        """The variance."""
        return self.variance

    def spectrum(self, w: Array) -> Array:
        """The variance."""
        return np.full_like(w, self.variance)

    def allan_variance(self, m: Array) -> Array:
        """v/m."""
        return self.variance / m

    def variogram(self, count: int) -> Array:
        """V beyond lag 0."""
        return np.asarray(self.variance * (np.arange(count) > 0).astype(float))


class Blue(_Sized):
    """Differences of white noise of variance v."""

    name = "blue"

    @property
    def power(self) -> float:
        """2v."""
        return 2.0 * self.variance

    def spectrum(self, w: Array) -> Array:
        """4 v sin²(w/2)."""
        return self.variance * _step(w) ** 2

    def allan_variance(self, m: Array) -> Array:
        """3v/m²."""
        return 3.0 * self.variance / m**2

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """What the ends of the record add falls as 1/n."""
        w = np.pi * j / n
        return self.spectrum(w) + self.variance * (4.0 / n) * np.cos(w / 2) ** 2

    def variogram(self, count: int) -> Array:
        """3v at lag 1, 2v beyond."""
        h = np.arange(count)
        return np.asarray(self.variance * np.where(h == 1, 3.0, np.where(h == 0, 0.0, 2.0)))


class RandomWalk(_Sized):
    """Sums of white noise of variance v."""

    name = "random_walk"

    def spectrum(self, w: Array) -> Array:
        """v/(4 sin²(w/2))."""
        return self.variance / _step(w) ** 2

    def allan_variance(self, m: Array) -> Array:
        """V (2m² + 1)/(6m)."""
        return self.variance * (2.0 * m**2 + 1.0) / (6.0 * m)

    def variogram(self, count: int) -> Array:
        """vh/2."""
        return np.asarray(self.variance * np.arange(count) / 2.0)


class Flicker(_Sized):
    """The half-order sum of white noise (Kasdin 1995)."""

    name = "flicker"

    def spectrum(self, w: Array) -> Array:
        """B²/(2 sin(w/2))."""
        return self.variance / _step(w)

    def allan_variance(self, m: Array) -> Array:
        """B² times that of the power law −1."""
        return self.variance * _power_law_allan(-1.0, m)

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """The spectrum, corrected for the ends of the record."""
        return self.spectrum(np.pi * j / n) * _power_law_ratio(-1.0, j, n)

    def variogram(self, count: int) -> Array:
        """B² times that of the power law −1."""
        return self.variance * _power_law_lags(-1.0, count)


@dataclass(frozen=True)
class PowerLaw(Term):
    """Fractional differences of white noise."""

    exponent: float
    level: float

    name = "power_law"

    @property
    def numbers(self) -> tuple[float, ...]:
        """Exponent, level²."""
        return self.exponent, self.level

    def scaled(self, factor: float) -> Self:
        """The level² times `factor`."""
        return replace(self, level=self.level * factor)

    def spectrum(self, w: Array) -> Array:
        """L (2 sin(w/2))^a."""
        return np.asarray(self.level * _step(w) ** self.exponent)

    def allan_variance(self, m: Array) -> Array:
        """Exact for short m, its two leading powers beyond."""
        return self.level * _power_law_allan(self.exponent, m)

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """The spectrum, corrected for the ends of the record."""
        return self.spectrum(np.pi * j / n) * _power_law_ratio(round(self.exponent, 6), j, n)

    def variogram(self, count: int) -> Array:
        """In closed form (Hosking 1981)."""
        return self.level * _power_law_lags(self.exponent, count)

    @property
    def generator(self) -> tuple[str, list[float]]:
        """Exponent and level."""
        return self.name, [self.exponent, float(np.sqrt(self.level))]


@dataclass(frozen=True)
class Exponential(Term):
    """A lag (real φ) or a damped oscillation (complex φ): r(h) = Re(a φ^h)."""

    a: complex
    phi: complex

    name = "exponential"

    @property
    def power(self) -> float:
        """r(0)."""
        return complex(self.a).real

    @property
    def numbers(self) -> tuple[float, ...]:
        """Re a, Im a, Re φ, Im φ."""
        a, phi = complex(self.a), complex(self.phi)
        return a.real, a.imag, phi.real, phi.imag

    def scaled(self, factor: float) -> Self:
        """A times `factor`."""
        return replace(self, a=self.a * factor)

    def spectrum(self, w: Array) -> Array:
        """1 − 2φ cos w + φ² written so that φ → 1, w → 0 keeps its digits."""
        a, phi = complex(self.a), complex(self.phi)
        return np.asarray((a * (1 - phi**2) / ((1 - phi) ** 2 + phi * _step(w) ** 2)).real)

    def allan_variance(self, m: Array) -> Array:
        """Exact lag sums for small m, the closed form above."""
        return _exponential_allan(complex(self.a), complex(self.phi), m)

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """Geometric sums over the lags."""
        return _exponential_cosine(complex(self.a), complex(self.phi), np.pi * j / n, n)

    def variogram(self, count: int) -> Array:
        """Re a(1 − φ^h), free of cancellation."""
        a, phi = complex(self.a), complex(self.phi)
        log_phi = np.log(phi) if phi != 0 else complex(-1e4)
        return np.asarray(-(a * np.expm1(np.arange(count) * log_phi)).real)

    @property
    def generator(self) -> tuple[str, list[float]] | None:
        """A plain lag of real, positive variance; None for what turns."""
        a_real, _, phi_real, phi_imag = self.numbers
        if phi_imag != 0.0 or a_real < 0.0:
            return None
        return "gauss_markov", [float(np.sqrt(a_real)), phi_real]


@dataclass(frozen=True)
class MovingAverage(_Sized):
    """White noise of variance v through a boxcar mean of L samples."""

    length: float

    name = "moving_average"

    @property
    def power(self) -> float:
        """v/L."""
        return self.variance / self.length

    @property
    def numbers(self) -> tuple[float, ...]:
        """Variance, length."""
        return self.variance, self.length

    def _lags(self, h: NDArray[np.int64]) -> Array:
        length = round(self.length)
        return np.asarray(self.variance * (1.0 - h / length) / length)

    def spectrum(self, w: Array) -> Array:
        """With its zeros."""
        ratio = np.sin(w * self.length / 2) / (self.length * np.sin(w / 2))
        return np.asarray(self.variance * ratio**2)

    def allan_variance(self, m: Array) -> Array:
        """From its few lags."""
        covariance = self._lags(np.arange(round(self.length)))
        return np.array([_allan_of_lags(covariance, int(k)) for k in m])

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """Without the ends the zeros of the filter would be deeper than any record shows them."""
        w = np.pi * j / n
        h = np.arange(1, min(round(self.length), n))
        angle = np.multiply.outer(w, h)
        ends = (n - h) * np.cos(angle) - np.sin(angle) / np.sin(w)[:, None]
        return self.variance / round(self.length) + (2.0 / n) * (ends @ self._lags(h))

    def variogram(self, count: int) -> Array:
        """Linear up to the length."""
        h = np.arange(count)
        return np.asarray(self.variance / self.length * np.minimum(h / self.length, 1.0))


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


def _power_law_ratio(exponent: float, j: NDArray[np.int64], n: int) -> Array:
    """E c_j²/s(w_j); what the ends do depends on j alone once n is large: 2048 samples show it to 1e-4."""
    ends = _power_law_ends(exponent, min(n, 2048))
    ratio = np.interp(j, np.arange(1, ends.size + 1), ends)
    beyond = j > ends.size
    ratio[beyond] = 1.0 + (ends[-1] - 1.0) * ends.size / j[beyond]
    return np.asarray(ratio)


def _exponential_cosine(a: complex, phi: complex, w: Array, n: int) -> Array:
    """Geometric sums of the formula in `Term.cosine_variance` for r(h) = Re(a φ^h)."""
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

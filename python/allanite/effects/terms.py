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
| `Lags` | r(0), r(1), …, r(L) | what they say, 0 beyond: a filter that ends |

A two-sided density in U²/Hz is s(w)·τ0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects._lags import (
    allan_of_lags,
    exponential_allan,
    power_law_allan,
    power_law_ends,
    power_law_lags,
)

__all__ = [
    "Blue",
    "Exponential",
    "Flicker",
    "Lags",
    "PowerLaw",
    "RandomWalk",
    "Term",
    "White",
]

Array = NDArray[np.float64]


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
        """Variance of a sample; by default None: it grows with the record."""
        return None

    def scaled(self, factor: float) -> Self:
        """The same process with its variance multiplied by `factor`."""
        raise NotImplementedError

    @property
    def inside(self) -> Term:
        """What it is in the ordinates of a record of which the first and the last sample are not looked at.

        By default itself: what its ends do is little, or of more than two samples.
        """
        return self

    def spectrum(self, w: Array) -> Array:
        """Spectrum s(w) at angular frequencies `w` in (0, π] per sample; shape of `w`."""
        raise NotImplementedError

    def allan_variance(self, m: Array) -> Array:
        """Exact Allan variance at integer averaging factors `m`; shape of `m`."""
        raise NotImplementedError

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """What crosses into the core for the ordinates of n samples."""
        return self.kernel

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """Exact expectation of the squared cosine-transform ordinates c_j, j = 1 … n − 1, of n samples; shape of `j`.

        For white noise and random walks this *is* the spectrum at w = πj/n. For the others the ends of the record
        add a little: r(h) contributes r(0) + (2/n) Σ_h r(h)[(n−h) cos(ah) − sin(ah)/sin(a)], a = πj/n.
        """
        return _kernels.Ordinates(j, n).variance([self.at_ordinates(n)])

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
        return type(self)(self.variance * factor)

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


@dataclass(frozen=True)
class Blue(_Sized):
    """Differences of white noise of variance v.

    Of n differences of w_0 … w_n the ordinates are 2 sin(πj/2n) times a sine transform of w_1 … w_{n−1}, independent of
    each other, and √(2/n) cos(πj/2n) times ±w_n − w_0: an impulse in the last sample and one in the first. Without these
    two samples, or with the `ends` 0, the ordinates have the spectrum exactly and are independent.
    """

    ends: bool = True

    name = "blue"

    def scaled(self, factor: float) -> Self:
        """The variance times `factor`."""
        return replace(self, variance=self.variance * factor)

    @property
    def inside(self) -> Blue:
        """Without what the ends add to all ordinates."""
        return replace(self, ends=False)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """The variance; without ends the power law of the same spectrum, to which none are added."""
        return self.kernel if self.ends else ("power_law", [2.0, self.variance, 1.0])

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
        return self.variance * power_law_allan(-1.0, m)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """The variance, and what the ends of the record do."""
        return self.name, [self.variance, *power_law_ends(-1.0, n)]

    def variogram(self, count: int) -> Array:
        """B² times that of the power law −1."""
        return self.variance * power_law_lags(-1.0, count)


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
        return type(self)(self.exponent, self.level * factor)

    def spectrum(self, w: Array) -> Array:
        """L (2 sin(w/2))^a."""
        return np.asarray(self.level * _step(w) ** self.exponent)

    def allan_variance(self, m: Array) -> Array:
        """Exact for short m, its two leading powers beyond."""
        return self.level * power_law_allan(self.exponent, m)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """Exponent, level², and what the ends of the record do."""
        return self.name, [*self.numbers, *power_law_ends(round(self.exponent, 6), n)]

    def variogram(self, count: int) -> Array:
        """In closed form (Hosking 1981)."""
        return self.level * power_law_lags(self.exponent, count)

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
        return type(self)(self.a * factor, self.phi)

    def spectrum(self, w: Array) -> Array:
        """1 − 2φ cos w + φ² written so that φ → 1, w → 0 keeps its digits."""
        a, phi = complex(self.a), complex(self.phi)
        return np.asarray((a * (1 - phi**2) / ((1 - phi) ** 2 + phi * _step(w) ** 2)).real)

    def allan_variance(self, m: Array) -> Array:
        """Exact lag sums for small m, the closed form above."""
        return exponential_allan(complex(self.a), complex(self.phi), m)

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
class Lags(Term):
    """White noise through a filter that ends: an autocovariance of a few lags."""

    covariance: tuple[float, ...]

    name = "lags"

    @property
    def power(self) -> float:
        """r(0)."""
        return self.covariance[0]

    @property
    def numbers(self) -> tuple[float, ...]:
        """r(0), r(1), …, r(L)."""
        return self.covariance

    def scaled(self, factor: float) -> Self:
        """Every lag times `factor`."""
        return type(self)(tuple(r * factor for r in self.covariance))

    def spectrum(self, w: Array) -> Array:
        """Σ r(h) cos hw."""
        series = [self.covariance[0], *(2.0 * r for r in self.covariance[1:])]
        return np.asarray(np.polynomial.chebyshev.chebval(np.cos(w), series))

    def allan_variance(self, m: Array) -> Array:
        """From its few lags."""
        covariance = np.array(self.covariance)
        return np.array([allan_of_lags(covariance, int(k)) for k in m])

    def variogram(self, count: int) -> Array:
        """R(0) − r(h)."""
        return self.covariance[0] - np.pad(self.covariance, (0, count))[:count]

    @property
    def generator(self) -> None:
        """None: the caller supplies the filter."""
        return

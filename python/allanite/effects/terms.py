"""Primitive random processes (terms); every stochastic effect is a sum of terms.

The parameters of a term refer to samples with spacing 1. The same terms are used for the spectrum, the Allan variance, the
covariance of estimates and the simulation:

| term | parameters | autocovariance r(h) or spectrum s(w), w = 2πfτ0 |
|---|---|---|
| `White` | variance | r(0) |
| `Blue` | variance v | x_k = w_{k+1} − w_k; s = 4 v sin²(w/2) |
| `RandomWalk` | step variance v | s = v/(4 sin²(w/2)) |
| `Flicker` | B² | s = B²/(2 sin(w/2)) |
| `PowerLaw` | exponent a, level² L | s = L (2 sin(w/2))^a |
| `Exponential` | complex a, φ | r(h) = Re(a φ^h) |
| `Lags` | r(0), r(1), …, r(L) | the given lags, 0 beyond: noise after a finite filter |

The two-sided density in U²/Hz is s(w)·τ0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects._declared import Array
from allanite.effects._lags import (
    allan_of_lags,
    exponential_allan,
    power_law_allan,
    power_law_ends,
    power_law_lags,
)


@dataclass(frozen=True)
class Term:
    """Base class of primitive random processes."""

    #: Name of the process in the compiled core.
    name: ClassVar[str]

    @property
    def numbers(self) -> tuple[float, ...]:
        """Tuple of the parameters in the order that the compiled core expects. Subclasses must define it."""
        raise NotImplementedError

    @property
    def kernel(self) -> tuple[str, list[float]]:
        """Pair (name of the term, list of its parameters), as the compiled core expects it."""
        return self.name, list(self.numbers)

    @property
    def power(self) -> float | None:
        """Variance of a sample, U²; None (default) for random walks, flicker noise and power laws."""
        return None

    def scaled(self, factor: float) -> Self:
        """Copy with its variance multiplied by `factor`. Subclasses must define it."""
        raise NotImplementedError

    @property
    def memory(self) -> int:
        """Number of samples at each end without which the cosine ordinates are independent; 0 by default.

        It is 0 for `Blue`, whose single sample at each end a fit masks if it matters.
        """
        return 0

    @property
    def inside(self) -> Term:
        """`Term` with the same spectrum, for records without their first and last sample; by default the term itself.

        Only for first differences of white noise (`Blue`) do these two samples cause all leakage into other ordinates.
        """
        return self

    def spectrum(self, w: Array) -> Array:
        """Spectrum s(w) at angular frequencies `w` in (0, π] per sample, shape of `w`."""
        raise NotImplementedError

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance at integer averaging factors `m`, shape of `m`. Subclasses must define it."""
        raise NotImplementedError

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """Pair (name, parameters) with which the core computes the variances of the cosine ordinates of n samples."""
        return self.kernel

    def cosine_variance(self, j: NDArray[np.int64], n: int) -> Array:
        """Variance of the cosine-transform coefficients c_j of n samples, for j in 1 … n − 1, shape of `j`.

        For white noise and random walks it is the spectrum at a = πj/n. For other terms the ends of the record add
        leakage: the variance is r(0) + (2/n) Σ_h r(h)[(n−h) cos(ah) − sin(ah)/sin(a)], with r the autocovariance.
        """
        return _kernels.Ordinates(j, n).variance([self.at_ordinates(n)])

    def variogram(self, count: int) -> Array:
        """Variogram r(0) − r(h) = ½ E[(x(k+h) − x(k))²], U², at lags h = 0 … count − 1."""
        raise NotImplementedError

    @property
    def generator(self) -> tuple[str, list[float]] | None:
        """Pair (name, parameters) of the random-number generator in the compiled core; None (default) if it has none."""
        return None


@dataclass(frozen=True)
class _Sized(Term):
    """Base class of terms with the variance as their only parameter."""

    variance: float

    @property
    def numbers(self) -> tuple[float, ...]:
        """Tuple with the variance only."""
        return (self.variance,)

    def scaled(self, factor: float) -> Self:
        """A copy with its variance multiplied by `factor`."""
        return type(self)(self.variance * factor)

    @property
    def generator(self) -> tuple[str, list[float]]:
        """Pair (name, [standard deviation]) of the random-number generator in the compiled core."""
        return self.name, [float(np.sqrt(self.variance))]


def _difference_gain(w: Array) -> Array:
    """Array of 2 sin(w/2), the gain of a first difference at angular frequencies `w`, shape of `w`."""
    return np.asarray(2.0 * np.sin(w / 2.0))


class White(_Sized):
    """Independent samples; in a sum with exponentials the variance may be negative."""

    name = "white"

    @property
    def power(self) -> float:
        """Variance v."""
        return self.variance

    def spectrum(self, w: Array) -> Array:
        """Array of the constant spectrum v, shape of `w`."""
        return np.full_like(w, self.variance)

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance v/m at averaging factors `m`, shape of `m`."""
        return self.variance / m

    def variogram(self, count: int) -> Array:
        """Array of the variogram at lags h = 0 … count − 1, shape (count,): 0 at lag 0, then v."""
        return np.asarray(self.variance * (np.arange(count) > 0).astype(float))


@dataclass(frozen=True)
class Blue(_Sized):
    """First differences of white noise of variance v.

    The ordinates of n differences of w_0 … w_n have two parts. The first part is 2 sin(πj/2n) times a sine transform of
    w_1 … w_{n−1}; its ordinates are independent. The second part is √(2/n) cos(πj/2n) times ±w_n − w_0, an impulse in the
    last sample and one in the first. Without these two samples, or with `ends` False, the ordinates are independent
    and their variances equal the spectrum exactly.
    """

    ends: bool = True

    name = "blue"

    def scaled(self, factor: float) -> Self:
        """A copy with its variance multiplied by `factor`."""
        return replace(self, variance=self.variance * factor)

    @property
    def inside(self) -> Blue:
        """Copy (`Blue`) whose cosine ordinates have no leakage from the first and last sample (`ends` False)."""
        return replace(self, ends=False)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """As `Term.at_ordinates`; if `ends` is False, the variances are the spectrum, without leakage of the ends."""
        return self.kernel if self.ends else ("power_law", [2.0, self.variance, 1.0])

    @property
    def power(self) -> float:
        """Variance of a sample, 2v."""
        return 2.0 * self.variance

    def spectrum(self, w: Array) -> Array:
        """Array of the spectrum 4 v sin²(w/2) at angular frequencies `w`, shape of `w`."""
        return self.variance * _difference_gain(w) ** 2

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance 3v/m² at averaging factors `m`, shape of `m`."""
        return 3.0 * self.variance / m**2

    def variogram(self, count: int) -> Array:
        """Array of the variogram at lags h = 0 … count − 1, shape (count,): 0, 3v, then 2v."""
        h = np.arange(count)
        return np.asarray(self.variance * np.where(h == 1, 3.0, np.where(h == 0, 0.0, 2.0)))


class RandomWalk(_Sized):
    """Cumulative sums of white noise of variance v."""

    name = "random_walk"

    def spectrum(self, w: Array) -> Array:
        """Array of the spectrum v/(4 sin²(w/2)) at angular frequencies `w`, shape of `w`."""
        return self.variance / _difference_gain(w) ** 2

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance v (2m² + 1)/(6m) at averaging factors `m`, shape of `m`."""
        return self.variance * (2.0 * m**2 + 1.0) / (6.0 * m)

    def variogram(self, count: int) -> Array:
        """Array of the variogram v·h/2 at lags h = 0 … count − 1, shape (count,)."""
        return np.asarray(self.variance * np.arange(count) / 2.0)


class Flicker(_Sized):
    """Half-order cumulative sum of white noise, flicker noise (Kasdin 1995); the variance is B²."""

    name = "flicker"

    def spectrum(self, w: Array) -> Array:
        """Array of the spectrum B²/(2 sin(w/2)) at angular frequencies `w`, shape of `w`."""
        return self.variance / _difference_gain(w)

    def allan_variance(self, m: Array) -> Array:
        """Allan variance, U², at averaging factors `m`: B² times that of a power law with the exponent −1."""
        return self.variance * power_law_allan(-1.0, m)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """Pair ("flicker", [B², q₁, …, q₆₄]) with the ratios q of `power_law_ends`; see `Term.at_ordinates`."""
        return self.name, [self.variance, *power_law_ends(-1.0, n)]

    def variogram(self, count: int) -> Array:
        """Array of the variogram at lags h = 0 … count − 1, shape (count,): B² times that of a power law f^{−1}."""
        return self.variance * power_law_lags(-1.0, count)


@dataclass(frozen=True)
class PowerLaw(Term):
    """Fractional differences of white noise: a power law with exponent a and level² L."""

    exponent: float
    level: float

    name = "power_law"

    @property
    def numbers(self) -> tuple[float, ...]:
        """Tuple of the exponent a and the level L (a variance)."""
        return self.exponent, self.level

    def scaled(self, factor: float) -> Self:
        """A copy with its `level` multiplied by `factor`."""
        return type(self)(self.exponent, self.level * factor)

    def spectrum(self, w: Array) -> Array:
        """Array of the spectrum L (2 sin(w/2))^a at angular frequencies `w`, shape of `w`."""
        return np.asarray(self.level * _difference_gain(w) ** self.exponent)

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance at averaging factors `m`: exact up to m = 1024, then its two leading powers of m."""
        return self.level * power_law_allan(self.exponent, m)

    def at_ordinates(self, n: int) -> tuple[str, list[float]]:
        """Pair ("power_law", [exponent, level, q₁, …, q₆₄]), q as in `power_law_ends`; see `Term.at_ordinates`."""
        return self.name, [*self.numbers, *power_law_ends(round(self.exponent, 6), n)]

    def variogram(self, count: int) -> Array:
        """Array of the variogram at lags h = 0 … count − 1, shape (count,), in closed form (Hosking 1981)."""
        return self.level * power_law_lags(self.exponent, count)

    @property
    def generator(self) -> tuple[str, list[float]]:
        """Pair ("power_law", [exponent, √`level`]) of the random-number generator in the compiled core."""
        return self.name, [self.exponent, float(np.sqrt(self.level))]


@dataclass(frozen=True)
class Exponential(Term):
    """A lag (real φ) or a damped oscillation (complex φ) with autocovariance r(h) = Re(a φ^h)."""

    a: complex
    phi: complex

    name = "exponential"

    @property
    def power(self) -> float:
        """Variance of a sample, r(0) = Re a."""
        return complex(self.a).real

    @property
    def numbers(self) -> tuple[float, ...]:
        """Tuple (Re a, Im a, Re φ, Im φ) of the autocovariance Re(a φ^h)."""
        a, phi = complex(self.a), complex(self.phi)
        return a.real, a.imag, phi.real, phi.imag

    def scaled(self, factor: float) -> Self:
        """A copy with `a` multiplied by `factor`."""
        return type(self)(self.a * factor, self.phi)

    def spectrum(self, w: Array) -> Array:
        """Spectrum Re[a(1 − φ²)/(1 − 2φ cos w + φ²)] at angular frequencies `w`, with all digits for φ → 1, w → 0."""
        a, phi = complex(self.a), complex(self.phi)
        return np.asarray(
            (a * (1 - phi**2) / ((1 - phi) ** 2 + phi * _difference_gain(w) ** 2)).real
        )

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance at averaging factors `m`: sums over lags up to m = 256, then a closed form."""
        return exponential_allan(complex(self.a), complex(self.phi), m)

    def variogram(self, count: int) -> Array:
        """Array of the variogram Re[a(1 − φ^h)] at lags h = 0 … count − 1, shape (count,), without cancellation."""
        a, phi = complex(self.a), complex(self.phi)
        log_phi = np.log(phi) if phi != 0 else complex(-1e4)
        return np.asarray(-(a * np.expm1(np.arange(count) * log_phi)).real)

    @property
    def generator(self) -> tuple[str, list[float]] | None:
        """Pair ("gauss_markov", [√a, φ]) of the core's generator; None for an oscillation (complex φ) or negative Re a."""
        a_real, _, phi_real, phi_imag = self.numbers
        if phi_imag != 0.0 or a_real < 0.0:
            return None
        return "gauss_markov", [float(np.sqrt(a_real)), phi_real]


@dataclass(frozen=True)
class Lags(Term):
    """White noise after a finite filter, given by an autocovariance of a few lags."""

    covariance: tuple[float, ...]

    name = "lags"

    @property
    def power(self) -> float:
        """Variance of a sample, r(0)."""
        return self.covariance[0]

    @property
    def memory(self) -> int:
        """Half of the last lag L, rounded up.

        If the ordinates were independent, the samples t and s of n samples would have the covariance r(t − s) + r(t + s
        + 1) + r(2n − 1 − t − s). The last two terms vanish if neither sample is one of the L/2 first or last.
        """
        return len(self.covariance) // 2

    @property
    def numbers(self) -> tuple[float, ...]:
        """Tuple of the autocovariance r(0), r(1), …, r(L)."""
        return self.covariance

    def scaled(self, factor: float) -> Self:
        """A copy with its autocovariance multiplied by `factor`."""
        return type(self)(tuple(r * factor for r in self.covariance))

    def spectrum(self, w: Array) -> Array:
        """Array of the spectrum Σ r(h) cos hw over all lags −L … L, shape of `w`."""
        series = [self.covariance[0], *(2.0 * r for r in self.covariance[1:])]
        return np.asarray(np.polynomial.chebyshev.chebval(np.cos(w), series))

    def allan_variance(self, m: Array) -> Array:
        """Array of the Allan variance at averaging factors `m`, computed from the autocovariance, shape of `m`."""
        covariance = np.array(self.covariance)
        return np.array([allan_of_lags(covariance, int(k)) for k in m])

    def variogram(self, count: int) -> Array:
        """Array of the variogram r(0) − r(h) at lags h = 0 … count − 1, shape (count,)."""
        return self.covariance[0] - np.pad(self.covariance, (0, count))[:count]

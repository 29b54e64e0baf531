"""Filters that act on all random processes: the terms of each process after the filter.

H(z) has as many zeros as poles, and all poles lie within the unit circle. With G(z) = H(z)H(1/z) the autocovariance after
the filter is the sum of the residues of S(z)G(z)z^{h−1}. Every pole φ of the spectrum S of a term remains, multiplied by
G(φ). Every pole p of the filter adds an exponential S(p)·(residue of G at p). Flicker and power laws have a branch cut
instead of poles; they are represented by a sum of first-order low-passes (a bank), two per decade.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import cleared_by_free_buffers
from allanite.effects._declared import Array
from allanite.effects._modifier import Modifier
from allanite.effects.terms import (
    Blue,
    Exponential,
    Flicker,
    Lags,
    PowerLaw,
    RandomWalk,
    Term,
    White,
)

#: Ratio of the longest time constant of a bank of low-passes to that of the slowest filter pole. Chosen by judgment; not
#: measured.
BANK_TIME_RATIO = 300.0
#: Minimum distance between a pole of a term and a pole of the filter, relative to the filter pole's distance from 1.
#: Residues of closer poles would lose their digits. Chosen by judgment; not measured.
MIN_POLE_DISTANCE = 1e-3
#: Maximum |p|⁻ᴸ (pole p, last lag L of a finite autocovariance) with which a filter pole's exponential is extracted; a
#: larger one overflows. Chosen by judgment; not measured.
MAX_INVERSE_POWER = 1e6
#: Length, in time constants, after which the covariance of a filter pole is cut (2·10⁻⁹). Chosen by judgment; not measured.
COVARIANCE_E_FOLDINGS = 20.0
#: Length, in time constants of the slowest pole, of the start of a simulation that is discarded (10⁻⁷ remains). Chosen by
#: judgment; not measured.
SETTLING_E_FOLDINGS = 16.0
#: Pole of an exponential that stands for a covariance at lag 1 alone: that at lag 2 is then 10⁻⁴ of that at lag 1. A
#: smaller pole would lose more digits in the sum with white noise.
FAST_POLE = 1e-4
#: Power gain at frequency zero up to which it counts as 0. Chosen by judgment; not measured.
MIN_GAIN_AT_ZERO = 1e-12


#: A complex number or an array of complex numbers.
Z = TypeVar("Z", complex, NDArray[np.complex128])


@dataclass(frozen=True)
class Response:
    """A digital filter H(z) = gain Π(1 − z_i/z)/Π(1 − p_i/z).

    It has as many zeros as poles, with complex conjugates adjacent. All poles are different.
    """

    gain: float
    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]

    @property
    def b(self) -> Array:
        """Array of the numerator coefficients in powers of 1/z, gain included, shape (order + 1,)."""
        return np.real(self.gain * np.poly(self.zeros))

    @property
    def a(self) -> Array:
        """Array of the denominator coefficients in powers of 1/z, shape (order + 1,); the first is 1."""
        return np.real(np.poly(self.poles))

    @property
    def settling(self) -> int:
        """Number of samples after which the start of a simulation is forgotten: 16 time constants of the slowest pole.

        The magnitude of the pole is limited to 0.001 … 1 − 1e-9.
        """
        slowest = max(abs(p) for p in self.poles)
        return int(np.ceil(SETTLING_E_FOLDINGS / -np.log(min(max(slowest, 1e-3), 1.0 - 1e-9))))

    def power(self, z: Z) -> Z:
        """Complex power gain G(z) = H(z)H(1/z) at a complex number or an array; on the unit circle it is |H|²."""
        one = 1.0 + 0.0 * z
        top = prod(((z - q) * (1.0 - q * z) for q in self.zeros), start=one)
        return self.gain**2 * top / prod(((z - p) * (1.0 - p * z) for p in self.poles), start=one)

    @cached_property
    def at_zero(self) -> float:
        """Power gain |H|² at frequency zero; gains up to 10⁻¹² become 0."""
        found = self.power(1.0).real
        return found if found > MIN_GAIN_AT_ZERO else 0.0

    @cached_property
    def lag_zero(self) -> float:
        """Variance of filtered white noise of variance 1 minus the sum of the exponentials of `modes` at lag 0; cached.

        It is the power gain G(z) (`power`) at z = 0.
        """
        return complex(self.gain**2 * prod(self.zeros) / prod(self.poles)).real

    @cached_property
    def modes(self) -> tuple[tuple[complex, complex], ...]:
        """Pairs (pole p, weight w): filtered white noise of variance 1 has the autocovariance Σ Re(w p^h), h > 0; cached.

        The weight is the residue of G(z)/z at the pole. A conjugate pair is represented by the pole above the real axis
        with twice its residue.
        """
        out = []
        for p in self.poles:
            if p.imag < 0.0:
                continue
            top = prod((p - q) * (1.0 - q * p) for q in self.zeros)
            others = prod(p - o for o in self.poles if o != p)
            bottom = p * others * prod(1.0 - o * p for o in self.poles)
            out.append((p, (2.0 if p.imag > 0.0 else 1.0) * self.gain**2 * top / bottom))
        return tuple(out)


@dataclass(frozen=True)
class Filter(Modifier):
    """A filter of the whole signal, in the sensor or its driver.

    Known functions of time are not filtered: their parameters describe the record after the filter.
    """

    #: True if the filter blocks frequency zero, and therefore drifts.
    blocks: ClassVar[bool] = False

    @property
    def whole(self) -> Filter | None:
        """The effect itself, if the filter acts on all random processes (default); None if it acts on white noise alone."""
        return self

    def response(self, rate: float) -> Response:
        """`Response` (gain, zeros, poles) of the digital filter at sampling rate `rate`, Hz; subclasses define it."""
        raise NotImplementedError

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Tuple of the terms of white noise of variance `white` after the filter; `span` is not used."""
        return self.passed((White(white),), rate)

    def passed(self, terms: tuple[Term, ...], rate: float) -> tuple[Term, ...]:
        """Spectral terms of a process after the filter, from its `terms` before the filter; `rate` in Hz."""
        response = _cached_response(self, rate)
        waves: list[Term] = [term for term in terms if isinstance(term, Exponential)]
        passed = _filtered_sum(waves, response, 0.0) if waves else []
        for term in terms:
            if not isinstance(term, Exponential):
                passed += _filtered_term(term, response)
        return _merged_terms(passed)


@cleared_by_free_buffers
@lru_cache(maxsize=4096)
def _cached_response(passing: Filter, rate: float) -> Response:
    """`Response` of the filter `passing` at `rate` Hz; cached, since a search tries the same filters in many models."""
    return passing.response(rate)


def _merged_terms(terms: list[Term]) -> tuple[Term, ...]:
    """Terms with the same total spectrum, in which white noises, `Lags`, and exponentials with equal poles are merged."""
    lags: dict[complex, complex] = {}
    rest: list[Term] = []
    white, finite = 0.0, np.zeros(0)
    for term in terms:
        if isinstance(term, Exponential):
            lags[complex(term.phi)] = lags.get(complex(term.phi), 0.0) + complex(term.a)
        elif isinstance(term, White):
            white += term.variance
        elif isinstance(term, Lags):
            finite = _sum_of_lags(finite, np.array(term.covariance))
        else:
            rest.append(term)
    rest += [Exponential(a, phi) for phi, a in lags.items()]
    if finite.size:
        rest.append(Lags(tuple(finite.tolist())))
    return (*rest, White(white)) if white else tuple(rest)


def _sum_of_lags(one: Array, other: Array) -> Array:
    """Array of the sum of two autocovariances from lag 0 on, as long as the longer one."""
    short, long = (one, other) if one.size < other.size else (other, one)
    out = long.copy()
    out[: short.size] += short
    return out


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def _filtered_term(term: Term, response: Response) -> tuple[Term, ...]:
    """Terms whose sum is `term` after the filter; cached.

    Flicker noise and power laws are approximated (`_sum_of_low_passes`); their gain at frequency zero is exact.
    """
    if isinstance(term, Blue):
        term = Lags((2.0 * term.variance, -term.variance))
    if isinstance(term, Lags):
        return tuple(_filtered_lags(np.array(term.covariance), response))
    if isinstance(term, (White, RandomWalk)):
        return tuple(_filtered_sum([term], response, 0.0))
    # The term times the gain at frequency zero, exactly, plus the difference computed with its bank of lags.
    own = [term.scaled(response.at_zero)] if response.at_zero else []
    return tuple(
        own + _filtered_sum(_sum_of_low_passes(term, response), response, response.at_zero)
    )


def _filtered_sum(pieces: list[Term], response: Response, less: float) -> list[Term]:
    """Terms of a sum of `pieces` after the filter, minus `less` times the unfiltered sum.

    `pieces` are white noise, random walks and exponentials. One exponential is added for each pole of the filter (one
    for a conjugate pair), even if its amplitude is 0. White noise and a random walk of variance 0 are omitted.
    """
    out: list[Term] = []
    # Spectra at the poles of the filter.
    spectra = [0.0j] * len(response.modes)
    white = 0.0
    waves = [piece for piece in pieces if isinstance(piece, Exponential)]
    for piece in pieces:
        if isinstance(piece, White):
            white += piece.variance
        elif isinstance(piece, RandomWalk):
            for k, (p, _) in enumerate(response.modes):
                spectra[k] += piece.variance / ((1.0 - p) * (1.0 - 1.0 / p))
            left = response.at_zero - less
            out += [piece.scaled(left)] if left else []
    if waves:
        more, passed = _filtered_waves(waves, response, less)
        spectra = [one + other for one, other in zip(spectra, more, strict=True)]
        out += passed
    for (p, weight), spectrum in zip(response.modes, spectra, strict=True):
        out.append(Exponential(weight * (spectrum + white), p))
    kept = white * (response.lag_zero - less)
    return [*out, White(kept)] if kept else out


def _filtered_waves(
    waves: list[Exponential], response: Response, less: float
) -> tuple[list[complex], list[Exponential]]:
    """Summed spectrum S(p) of `waves` at each pole p of `response.modes`, and the filtered `waves`.

    Each filtered exponential is multiplied by the power gain at its pole, minus `less`.
    """
    a = np.array([wave.a for wave in waves], dtype=complex)
    phi = np.array([_separated_pole(complex(wave.phi), response) for wave in waves])
    # A real pole is its own conjugate, so that both sides together have the real part of its amplitude.
    sides = [(0.5 * a, phi), (0.5 * a.conj(), phi.conj())]
    spectra = [
        complex(sum(u * (1.0 - z * z) / ((1.0 - z * p) * (1.0 - z / p)) for u, z in sides).sum())
        for p, _ in response.modes
    ]
    after = (a * (response.power(phi) - less)).tolist()
    return spectra, [Exponential(*each) for each in zip(after, phi.tolist(), strict=True)]


def _separated_pole(phi: complex, response: Response) -> complex:
    """Complex pole: `phi`, unless it nearly equals a pole p of the filter.

    It is then moved to the distance 0.001·|1 − p| from p, because the residues of equal poles are infinite.
    """
    for p in response.poles:
        near = MIN_POLE_DISTANCE * abs(1.0 - p)
        if abs(phi - p) < near:
            return p + (near if abs(p) + near < 1.0 and p.real < phi.real else -near)
    return phi


def _sum_of_low_passes(term: Term, response: Response) -> list[Term]:
    """White noise, exponentials and random walks whose sum approximates a power law or flicker `term`, unfiltered.

    The poles of the filter determine the accuracy at low frequencies. Time constants reach from one sample to 300 times
    the slowest time constant of the filter.
    """
    exponent, level = (
        (term.exponent, term.level) if isinstance(term, PowerLaw) else (-1.0, term.numbers[0])
    )
    assert isinstance(term, (PowerLaw, Flicker))
    n = int(BANK_TIME_RATIO / min(abs(1.0 - p) for p in response.poles))
    inner = exponent + (2.0 if exponent < -2.0 else -2.0 if exponent > 0.0 else 0.0)
    out: list[Term] = []
    for phi, v in _kernels.power_law_bank(inner, max(n, 16)):
        a = v * level
        if inner == exponent:
            out.append(Exponential(a, phi) if phi else White(a))
        elif exponent > 0.0:
            # First differences of a lag.
            if phi:
                out += [
                    Exponential(-a * (1.0 - phi) ** 2 / phi, phi),
                    White(a * (1.0 - phi) * (1.0 + phi) / phi),
                ]
            else:
                # Autocovariance 2a, −a, 0 … of differences of white noise: a fast exponential plus white noise.
                out += [Exponential(-a / FAST_POLE, FAST_POLE), White(2.0 * a + a / FAST_POLE)]
        else:
            # Cumulative sums of a lag.
            out.append(RandomWalk(a * (1.0 + phi) / (1.0 - phi)))
            if phi:
                out.append(Exponential(-a * phi / (1.0 - phi) ** 2, phi))
    return out


def _filtered_lags(covariance: Array, response: Response) -> list[Term]:
    """Some exponentials, then one `Lags`: a process with the finite autocovariance r(0), r(1), … after the filter.

    Fast poles of the filter give no exponential: their autocovariance is part of the `Lags`.
    """
    last = covariance.size - 1
    both = np.concatenate([covariance[:0:-1], covariance])
    out: list[Term] = []
    finite = response.lag_zero * covariance
    for p, w in response.modes:
        # |p|⁻ᵏ of a fast pole would overflow.
        slow = -last * np.log(abs(p)) < np.log(MAX_INVERSE_POWER)
        reach = last + (0 if slow else int(np.ceil(COVARIANCE_E_FOLDINGS / -np.log(abs(p)))))
        own = p ** np.arange(reach + last + 1)
        sides = np.concatenate([own[last:0:-1], own])
        # r(h) = Σ_l r_in(l)·Re(w p^|h−l|), h = 0 … reach.
        exact = np.convolve(sides, both, "valid")[: reach + 1]
        if slow:
            a = w * complex(both @ p ** np.arange(last, -last - 1, -1.0))
            out.append(Exponential(a, p))
            exact = w * exact - a * p ** np.arange(exact.size)
        else:
            exact = w * exact
        finite = _sum_of_lags(finite, np.real(exact))
    return [*out, Lags(tuple(finite.tolist()))]

"""Filters that everything random has passed: what is left of each primitive term behind them.

H(z) has as many zeros as poles, all poles within the unit circle. With G(z) = H(z)H(1/z) the autocovariance behind the
filter is the sum of the residues of S(z)G(z)z^{h−1}: every pole φ of the spectrum S of a term stays, times G(φ), and every
pole p of the filter adds an exponential S(p)·(residue of G at p). Flicker and power laws have no poles but a cut; there
they are a bank of lags, two a decade.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import cleared_by_free_buffers
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

__all__ = ["Filter", "Response"]

Array = NDArray[np.float64]

#: A bank of lags reaches this far below the slowest pole of the filter.
BELOW = 300.0
#: Poles of a bank and of a filter stand apart by this part of their distance from 1: residues keep their digits.
APART = 1e-3
#: Exponentials that pass a filter one by one, remembered: what has a few is asked for again and again.
FEW = 4
#: Power of a pole that may still be divided by.
DIVIDED = 1e6
#: What of a response has died away, in e-foldings: of a covariance, of the start of a simulation.
GONE, SETTLED = 20.0, 16.0
#: Gain at frequency zero below which nothing passes.
NOTHING = 1e-12


@dataclass(frozen=True)
class Response:
    """A digital filter: gain Π(1 − z_i/z)/Π(1 − p_i/z), conjugates beside each other.

    Attributes
    ----------
    gain : float
    zeros, poles : tuple of complex
        As many of one as of the other; the poles differ from each other.
    """

    gain: float
    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]

    @property
    def b(self) -> Array:
        """Numerator over powers of 1/z."""
        return np.real(self.gain * np.poly(self.zeros))

    @property
    def a(self) -> Array:
        """Denominator over powers of 1/z, beginning with 1."""
        return np.real(np.poly(self.poles))

    @property
    def settling(self) -> int:
        """Samples after which the start of a simulation is forgotten."""
        slowest = max(abs(p) for p in self.poles)
        return int(np.ceil(SETTLED / -np.log(min(max(slowest, 1e-3), 1.0 - 1e-9))))

    def power(self, z: complex) -> complex:
        """G(z) = H(z)H(1/z)."""
        top = prod((z - q) * (1.0 - q * z) for q in self.zeros)
        bottom = prod((z - p) * (1.0 - p * z) for p in self.poles)
        return complex(self.gain**2 * top / bottom)

    @cached_property
    def at_zero(self) -> float:
        """Gain of power at frequency zero."""
        found = self.power(1.0).real
        return found if found > NOTHING else 0.0

    @cached_property
    def lag_zero(self) -> float:
        """What white noise keeps at lag 0 beyond its exponentials: G(0)."""
        return complex(self.gain**2 * prod(self.zeros) / prod(self.poles)).real

    @cached_property
    def modes(self) -> tuple[tuple[complex, complex], ...]:
        """Exponentials behind white noise of variance 1: each pole and the residue of G(z)/z there.

        Of a conjugate pair one, with twice its residue.
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
    """A filter of the whole signal, as it stands behind the sensor or in its driver.

    Known functions of time are what they are in the record, behind the filter.
    """

    #: Whether nothing of frequency zero passes, and so no drift.
    blocks: ClassVar[bool] = False

    @property
    def whole(self) -> Filter:
        """Itself."""
        return self

    def response(self, rate: float) -> Response:
        """The filter at this `rate`, Hz."""
        raise NotImplementedError

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """White noise behind the filter."""
        return self.passed((White(white),), rate)

    def passed(self, terms: tuple[Term, ...], rate: float) -> tuple[Term, ...]:
        """What is left of the `terms` of an effect at `rate` Hz."""
        response = _response(self, rate)
        # A band that moves is dozens of them: what all leave at a pole of the filter is one exponential.
        waves: list[Term] = [term for term in terms if isinstance(term, Exponential)]
        if len(waves) > FEW:
            rest = [term for term in terms if not isinstance(term, Exponential)]
            passed = _of_pieces(waves, response, 0.0)
            return _merged([*passed, *(p for term in rest for p in _passed(term, response))])
        return _merged([part for term in terms for part in _passed(term, response)])


@cleared_by_free_buffers
@lru_cache(maxsize=64)
def _response(passing: Filter, rate: float) -> Response:
    """The response of a filter, which all effects of a model pass one after the other."""
    return passing.response(rate)


def _merged(terms: list[Term]) -> tuple[Term, ...]:
    """Exponentials of one pole as one, white noise as one, finite covariances as one."""
    lags: dict[complex, complex] = {}
    rest: list[Term] = []
    white, finite = 0.0, np.zeros(0)
    for term in terms:
        if isinstance(term, Exponential):
            lags[complex(term.phi)] = lags.get(complex(term.phi), 0.0) + complex(term.a)
        elif isinstance(term, White):
            white += term.variance
        elif isinstance(term, Lags):
            own = np.array(term.covariance)
            size = max(own.size, finite.size)
            finite = np.pad(finite, (0, size - finite.size)) + np.pad(own, (0, size - own.size))
        else:
            rest.append(term)
    rest += [Exponential(a, phi) for phi, a in lags.items()]
    if finite.size:
        rest.append(Lags(tuple(map(float, finite))))
    return (*rest, White(white)) if white else tuple(rest)


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def _passed(term: Term, response: Response) -> tuple[Term, ...]:
    if isinstance(term, Blue):
        term = Lags((2.0 * term.variance, -term.variance))
    if isinstance(term, Lags):
        return tuple(_of_lags(np.array(term.covariance), response))
    if isinstance(term, (White, Exponential, RandomWalk)):
        return tuple(_of_pieces([term], response, 0.0))
    # The term itself, exactly, and what the filter takes from its bank of lags or adds to it.
    own = [term.scaled(response.at_zero)] if response.at_zero else []
    return tuple(own + _of_pieces(_bank(term, response), response, response.at_zero))


def _of_pieces(pieces: list[Term], response: Response, less: float) -> list[Term]:
    """Rational terms behind the filter, less a part of themselves."""
    out: list[Term] = []
    # Spectra at the poles of the filter, of which there are few, as of pieces: arrays would cost more than they save.
    spectra = [0.0j] * len(response.modes)
    white = 0.0
    for piece in pieces:
        if isinstance(piece, White):
            white += piece.variance
        elif isinstance(piece, RandomWalk):
            for k, (p, _) in enumerate(response.modes):
                spectra[k] += piece.variance / ((1.0 - p) * (1.0 - 1.0 / p))
            left = response.at_zero - less
            out += [piece.scaled(left)] if left else []
        else:
            assert isinstance(piece, Exponential)
            a, phi = complex(piece.a), _apart(complex(piece.phi), response)
            sides = (
                ((0.5 * a, phi), (0.5 * a.conjugate(), phi.conjugate()))
                if phi.imag
                else ((complex(a.real), phi),)
            )
            for k, (p, _) in enumerate(response.modes):
                for amount, at in sides:
                    spectra[k] += amount * (1.0 - at * at) / ((1.0 - at * p) * (1.0 - at / p))
            out.append(Exponential(a * (response.power(phi) - less), phi))
    for (p, weight), spectrum in zip(response.modes, spectra, strict=True):
        out.append(Exponential(weight * (spectrum + white), p))
    kept = white * (response.lag_zero - less)
    return [*out, White(kept)] if kept else out


def _apart(phi: complex, response: Response) -> complex:
    """A pole of a spectrum, moved a little where the filter has the same."""
    for p in response.poles:
        near = APART * abs(1.0 - p)
        if abs(phi - p) < near:
            return p + (near if abs(p) + near < 1.0 and p.real < phi.real else -near)
    return phi


def _bank(term: Term, response: Response) -> list[Term]:
    """A power law as lags (and what runs through them), from well below the filter's slowest pole on."""
    exponent, level = (
        (term.exponent, term.level) if isinstance(term, PowerLaw) else (-1.0, term.numbers[0])
    )
    assert isinstance(term, (PowerLaw, Flicker))
    n = int(BELOW / min(abs(1.0 - p) for p in response.poles))
    inner = exponent + (2.0 if exponent < -2.0 else -2.0 if exponent > 0.0 else 0.0)
    out: list[Term] = []
    for phi, v in _kernels.power_law_bank(inner, max(n, 16)):
        a = v * level
        if inner == exponent:
            out.append(Exponential(a, phi) if phi else White(a))
        elif exponent > 0.0:
            # Differences of a lag.
            if phi:
                out += [
                    Exponential(-a * (1.0 - phi) ** 2 / phi, phi),
                    White(a * (1.0 - phi) * (1.0 + phi) / phi),
                ]
            else:
                out += _finite(np.array([2.0 * a, -a]))
        else:
            # Running sums of a lag.
            out.append(RandomWalk(a * (1.0 + phi) / (1.0 - phi)))
            if phi:
                out.append(Exponential(-a * phi / (1.0 - phi) ** 2, phi))
    return out


def _finite(covariance: Array) -> list[Term]:
    """A difference of white noise as a lag of hardly any memory: its covariance at lag 1 and none beyond."""
    phi = 1e-4
    a = float(covariance[1]) / phi
    return [Exponential(a, phi), White(float(covariance[0]) - a)]


def _of_lags(covariance: Array, response: Response) -> list[Term]:
    """A covariance that ends, behind the filter: exponentials, and another one that ends."""
    last = covariance.size - 1
    both = np.concatenate([covariance[:0:-1], covariance])
    out: list[Term] = []
    finite = response.lag_zero * covariance
    for p, w in response.modes:
        slow = -last * np.log(abs(p)) < np.log(DIVIDED)  # |p|⁻ᵏ of a fast pole is beyond doubles
        reach = last + (0 if slow else int(np.ceil(GONE / -np.log(abs(p)))))
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
        size = max(exact.size, finite.size)
        finite = np.pad(finite, (0, size - finite.size)) + np.pad(
            np.real(exact), (0, size - exact.size)
        )
    return [*out, Lags(tuple(map(float, finite)))]

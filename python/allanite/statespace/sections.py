"""Sections of a state space: one independent block of states for each primitive term.

| term | states | recursion |
|---|---|---|
| ``white`` | 0 | adds to R |
| ``blue`` | 2 | difference of successive white samples |
| ``random_walk`` | 1 | sum of white samples; its first level is unknown |
| ``exponential`` | 1, or 2 for a complex pole | an AR(1) process, or a rotating pair |
| exponentials and white, one of them negative | 2 or more | the ARMA process of that spectrum |
| ``flicker``, ``power_law`` in [−2, 0] | 1 per AR(1) process | sum of AR(1) processes (two per decade) |
| ``power_law`` above 0 | 2 per AR(1) process | differences of such a sum |
| ``power_law`` below −2 | 2 per AR(1) process | running sums of such a sum |
| ``lags`` | 1 per lag of the autocovariance | the moving average with that spectrum |

An AR(1) process is white noise behind a first-order low-pass filter (Gauss-Markov in IEEE 952).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.effects import Filter
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


@dataclass(frozen=True, eq=False)
class Section:
    """Block of a state space: s ← F s + w, cov w = Q, which adds H s and white noise of variance R to the samples.

    `terms` are the same process as primitive terms; empty if an earlier section contains them. `diffuse` says that the
    initial level of its first state is unknown; P0 is 0 there.
    """

    F: Array
    Q: Array
    H: Array
    P0: Array
    terms: tuple[Term, ...]
    R: float = 0.0
    diffuse: bool = False

    @property
    def states(self) -> int:
        """Number of states of the section; 0 for white noise."""
        return self.H.size

    @property
    def is_ar1(self) -> bool:
        """True if the section is an AR(1) process: one state with a stationary start, no additional white noise."""
        return self.states == 1 and not self.diffuse and self.R == 0.0


def sections_of(terms: Iterable[Term], n: int) -> list[Section]:
    """List of `Section` whose sum has the covariance of all `terms`, for up to `n` samples.

    Raises `InputError` for a term that has no state space.
    """
    terms = tuple(terms)
    white = sum(t.variance for t in terms if isinstance(t, White))
    exponentials = [t for t in terms if isinstance(t, Exponential)]
    out: list[Section] = []
    single = [_exponential(t) for t in exponentials]
    if white < 0.0 or None in single:
        together = _driven_together(exponentials) if white >= 0.0 else None
        if together is None:
            out.append(_arma((*exponentials, White(white))))
        else:
            out += [together, *([_white(white)] if white else [])]
    else:
        out += [s for s in single if s is not None]
        if white:
            out.append(_white(white))
    for term in terms:
        if isinstance(term, (White, Exponential)):
            continue
        if isinstance(term, Blue):
            out.append(_difference(0.0, term.variance, (term,)))
        elif isinstance(term, RandomWalk):
            out.append(_random_walk(term.variance))
        elif isinstance(term, Flicker):
            out += _power_law(-1.0, term.variance, n)
        elif isinstance(term, PowerLaw):
            out += _power_law(term.exponent, term.level, n)
        elif isinstance(term, Lags):
            out.append(_moving_average(term.covariance))
        else:
            raise InputError(f"no state space for a process {term.name!r}")
    return out


def line(amplitude: float, w: float) -> Section:
    """Section of a sinusoid of `w` rad per sample, this amplitude and unknown phase: an undamped rotation, 2 states."""
    turn = np.array([[np.cos(w), -np.sin(w)], [np.sin(w), np.cos(w)]])
    power = 0.5 * amplitude**2
    term = Exponential(power, complex(np.cos(w), np.sin(w)))
    return Section(turn, np.zeros((2, 2)), np.array([1.0, 0.0]), power * np.eye(2), (term,))


def ar1(phi: float, variance: float) -> Section:
    """Section of the AR(1) process u(k+1) = φ u(k) + w with the stationary variance `variance`."""
    return Section(
        np.array([[phi]]),
        np.array([[variance * (1.0 - phi) * (1.0 + phi)]]),
        np.ones(1),
        np.array([[variance]]),
        (Exponential(variance, phi),),
    )


def _white(variance: float) -> Section:
    """Section of white noise with this variance: no states, only R."""
    empty = np.zeros((0, 0))
    return Section(empty, empty, np.zeros(0), empty, (White(variance),), R=max(variance, 0.0))


def _random_walk(step: float) -> Section:
    """Section of a random walk of unknown initial level; `step` is the variance of its steps."""
    one = np.ones((1, 1))
    return Section(one, step * one, np.ones(1), 0.0 * one, (RandomWalk(step),), diffuse=True)


def _exponential(term: Exponential) -> Section | None:
    """Section of one exponential term of an autocovariance: AR(1) for a real φ, a rotating pair of states for a complex φ.

    None if no process has this term alone, because its spectral density is negative somewhere.
    """
    a, phi = complex(term.a), complex(term.phi)
    if phi.imag == 0.0:
        return ar1(phi.real, a.real) if a.real >= 0.0 and a.imag == 0.0 else None
    c, s = phi.real, phi.imag
    p, e = a.real, a.imag
    # P = [[p, e], [e, q]] gives r(h) = Re(aφ^h) for any q; the one with the largest det Q is taken.
    first, middle, last = (
        p * (1 - c * c) + 2 * c * s * e,
        e * (1 - c * c + s * s) - c * s * p,
        s * s * p + 2 * c * s * e,
    )
    q = (first * (1 - c * c) + s * s * last - 2 * middle * c * s) / (2 * s * s)
    Q = np.array(
        [[first - s * s * q, middle + c * s * q], [middle + c * s * q, (1 - c * c) * q - last]]
    )
    values, vectors = np.linalg.eigh(Q)
    if values[0] < -1e-9 * abs(values[1]) or values[1] < 0.0:
        return None
    Q = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return Section(
        np.array([[c, -s], [s, c]]),
        Q,
        np.array([1.0, 0.0]),
        np.array([[p, e], [e, q]]),
        (term,),
    )


def _driven_together(terms: Sequence[Exponential]) -> Section | None:
    """Section of rotating pairs of states that one white noise drives: a band of resonators in series; None for others.

    The complex amplitudes z_k of the pairs have E[z_k z̄_l] ∝ b_k b̄_l/(−λ_k − λ̄_l) with λ = ln φ and
    b_k = 1/Π_j(λ_k − λ_j). None unless the amplitudes of the terms are the sums of these over l.
    """
    phi = np.array([complex(t.phi) for t in terms])
    if len(terms) < 2 or np.any(phi.imag == 0.0):
        return None
    a, log_phi = np.array([complex(t.a) for t in terms]), np.log(phi)
    apart = log_phi[:, None] - log_phi + np.eye(phi.size)
    decay = log_phi[:, None] + log_phi.conj()
    drive = 1.0 / apart.prod(axis=1)
    shared = -np.outer(drive, drive.conj()) / decay
    shared *= a.sum().real / shared.sum().real
    if np.abs(shared.sum(axis=1) - a).max() > 1e-6 * np.abs(a).max():
        return None
    noise = -shared * np.expm1(decay)
    F, P, Q = (
        np.block([[m.real, -m.imag], [m.imag, m.real]]) for m in (np.diag(phi), shared, noise)
    )
    return Section(F, Q, np.repeat([1.0, 0.0], phi.size), P, tuple(terms))


def _arma(terms: tuple[Term, ...]) -> Section:
    """Section of the ARMA process whose spectrum is the sum of the spectra of `terms` (`Exponential` and `White`)."""
    from allanite.simulate import arma

    return _harvey(*arma(terms), terms)


def _harvey(gain: float, b: list[float], a: list[float], terms: tuple[Term, ...]) -> Section:
    """Section of the ARMA process `gain`·b(1/z) / (1 + a[0]/z + a[1]/z² + …), in Harvey's state-space form."""
    d = max(1 + max((i for i, value in enumerate(b) if value), default=0), len(a))
    F = np.eye(d, k=1)
    F[: len(a), 0] = -np.array(a)
    drive = gain * np.array(b[:d] + [0.0] * (d - len(b)))
    Q = np.outer(drive, drive)
    return Section(F, Q, np.eye(d)[0], stationary_covariance(F, Q), terms)


def stationary_covariance(F: Array, Q: Array) -> Array:
    """Array: stationary covariance Σ F^k Q F^kᵀ of states with transition F and process noise Q."""
    total, step = Q, F
    for _ in range(64):
        total, step = total + step @ total @ step.T, step @ step
    return np.asarray(0.5 * (total + total.T))


def _moving_average(lags: tuple[float, ...]) -> Section:
    """Section of the moving average with the autocovariance `lags` = r(0), r(1), …; white noise if only r(0) is given.

    The coefficients are the limits of the gains of its Kalman filter (Bauer 1955), after at least 1000 steps. If the
    spectrum has a zero, the error after k steps is about 1/k.
    """
    order = len(lags) - 1
    if order == 0:
        return _white(lags[0])
    r = np.array(lags[1:])
    P = np.zeros((order, order))
    for _ in range(max(1000, 40 * order)):
        left = lags[0] - P[0, 0]
        gain = (r - np.append(P[1:, 0], 0.0)) / left
        P = np.pad(P[1:, 1:], ((0, 1), (0, 1))) + left * np.outer(gain, gain)
    return _harvey(float(np.sqrt(left)), [1.0, *map(float, gain)], [], (Lags(lags),))


def _difference(phi: float, variance: float, terms: tuple[Term, ...] = ()) -> Section:
    """Section of the differences u(k) − u(k−1) of an AR(1) process u with the coefficient `phi` and this variance.

    Without `terms` of the differences, `phi` must not be 0.
    """
    F = np.array([[phi, 0.0], [1.0, 0.0]])
    Q = np.diag([variance * (1.0 - phi**2), 0.0])
    P0 = variance * np.array([[1.0, phi], [phi, 1.0]])
    if not terms:
        # r(h) = 2vφ^h − vφ^{h−1} − vφ^{h+1} for h > 0; the white term corrects lag 0.
        slope = variance * (1.0 - phi) ** 2 / phi
        terms = (
            Exponential(-slope, phi),
            White(2.0 * variance * (1.0 - phi) + slope),
        )
    return Section(F, Q, np.array([1.0, -1.0]), P0, terms)


def _running_sum(phi: float, variance: float, terms: tuple[Term, ...]) -> Section:
    """Section of the running sum z(k+1) = z(k) + u(k) of an AR(1) process u with this variance; z(0) is unknown.

    `terms` (its covariance) may be empty if another section contains them.
    """
    F = np.array([[1.0, 1.0], [0.0, phi]])
    Q = np.diag([0.0, variance * (1.0 - phi**2)])
    P0 = np.diag([0.0, variance])
    return Section(F, Q, np.array([1.0, 0.0]), P0, terms, diffuse=True)


def _power_law(exponent: float, level: float, n: int) -> list[Section]:
    """List of `Section` whose sum has the spectrum level·(2 sin(w/2))^exponent, w in rad per sample.

    The error is below 0.1 % from 1/(4n) to ½ cycles per sample. Empty for the level 0; one random walk for the exponent
    −2.
    """
    if level == 0.0:
        return []
    if exponent == -2.0:
        return [_random_walk(level)]
    if exponent > 0.0:
        bank = _kernels.power_law_bank(exponent - 2.0, n)
        return [_difference(phi, v * level, () if phi else (Blue(v * level),)) for phi, v in bank]
    if exponent < -2.0:
        bank = _kernels.power_law_bank(exponent + 2.0, n)
        # The first section carries the term of the sum. A term of each section would be a difference of nearly equal
        # ones.
        whole: list[tuple[Term, ...]] = [(PowerLaw(exponent, level),)]
        terms = whole + [()] * (len(bank) - 1)
        return [_running_sum(phi, v * level, t) for (phi, v), t in zip(bank, terms, strict=True)]
    bank = _kernels.power_law_bank(exponent, n)
    return [ar1(phi, v * level) if phi else _white(v * level) for phi, v in bank]


def resized(section: Section, factor: float) -> Section:
    """Copy of the section whose variances are multiplied by `factor`."""
    terms = tuple(t.scaled(factor) for t in section.terms)
    scaled = {name: factor * getattr(section, name) for name in ("Q", "P0", "R")}
    return replace(section, **scaled, terms=terms)


def is_line(term: Term) -> bool:
    """True if a term is a spectral line, which has no finite density."""
    return isinstance(term, Exponential) and abs(complex(term.phi)) >= 1.0


def density_of(terms: Iterable[Term], w: Array) -> Array:
    """Array: two-sided spectrum, U² per cycle per sample, of the sum of terms at w rad per sample, without lines."""
    return np.asarray(sum((t.spectrum(w) for t in terms if not is_line(t)), np.zeros_like(w)))


def allan_variance_of(terms: Iterable[Term], m: Array) -> Array:
    """Array: Allan variance, U², of the sum of terms at the averaging factors m (samples), shape of m."""
    return np.asarray(sum((t.allan_variance(m) for t in terms), np.zeros(m.size)))


def filtered_section(sections: Sequence[Section], filtering: Filter, rate: float) -> Section:
    """`Section` of the sum of all `sections` after the filter, at the sampling rate `rate` (Hz).

    White noise becomes a state, because it drives the filter's states as well as the sample. States of unknown level
    come first. They are omitted if the filter blocks a constant level. The filter's states are relative to their
    equilibrium at the level, so that they are stationary.
    """
    from scipy.linalg import block_diag

    terms = filtering.passed(tuple(t for s in sections for t in s.terms), rate)
    white = np.array([[sum(s.R for s in sections)]])
    if white.any():
        zero = np.zeros((1, 1))
        sections = [*sections, Section(zero, white, np.ones(1), white, ())]
    F, Q = (block_diag(*(getattr(s, name) for s in sections)) for name in ("F", "Q"))
    H = np.concatenate([s.H for s in sections])
    # Marks the states of unknown level.
    levels = np.concatenate([np.arange(s.states) < s.diffuse for s in sections])
    response = filtering.response(rate)
    a, b = response.a[1:], response.b
    inside, order = H.size, a.size
    # Transposed direct form: f ← A f + B u, output f_0 + b_0 u.
    A = np.eye(order, k=1)
    A[:, 0] = -a
    B = b[1:] - a * b[0]
    size = inside + order
    whole, noise = np.zeros((size, size)), np.zeros((size, size))
    whole[:inside, :inside], noise[:inside, :inside] = F, Q
    whole[inside:, :inside], whole[inside:, inside:] = np.outer(B, H), A
    out = np.concatenate([b[0] * H, np.eye(order)[0]])
    held = np.linalg.solve(np.eye(order) - A, B)
    turn = np.eye(size)
    turn[inside:, :inside] = -np.outer(held, np.where(levels, H, 0.0))
    back = 2.0 * np.eye(size) - turn
    whole, noise, out = turn @ whole @ back, turn @ noise @ turn.T, out @ back
    first = np.flatnonzero(np.pad(levels, (0, order)))
    stationary = np.setdiff1d(np.arange(size), first)
    P0 = np.zeros((size, size))
    P0[np.ix_(stationary, stationary)] = stationary_covariance(
        whole[np.ix_(stationary, stationary)], noise[np.ix_(stationary, stationary)]
    )
    seen = bool(response.at_zero)
    order_of = np.concatenate([first, stationary]) if seen else stationary
    pick = np.ix_(order_of, order_of)
    return Section(
        whole[pick],
        noise[pick],
        out[order_of],
        P0[pick],
        terms,
        diffuse=seen and first.size > 0,
    )

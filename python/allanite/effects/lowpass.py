"""Low-pass filters behind white noise: autocovariances as primitive terms, and the same filters for simulation.

Frequencies are in cycles per sample; every filter lets frequency zero pass unchanged.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.common.memory import cleared_by_free_buffers
from allanite.effects._filter import Response
from allanite.effects.terms import Exponential, Lags, Term, White

__all__ = ["DESIGNS", "HIGHEST", "RECURSIVE", "SCANNED", "generators", "response", "terms"]

Array = NDArray[np.float64]
Poles = NDArray[np.complex128]
Generators = list[tuple[str, list[float]]]

#: Orders of each design; those of ``fir`` are lengths in samples.
DESIGNS: dict[str, tuple[int, ...]] = {
    "sampled": (1, 2, 3, 4),
    "digital": (1, 2, 3, 4),
    "cascaded": (2,),
    "smoothed": (2, 3),
    "moving_average": (1, 2, 3),
    "fir": (8, 12, 16, 24, 32, 48, 64),
}
#: Designs with poles, which can act on all that is random.
RECURSIVE = ("sampled", "digital", "cascaded", "smoothed")
#: (design, order) in the order in which they are tried; the simpler first.
SCANNED = (
    ("sampled", 1),
    ("digital", 1),
    ("moving_average", 1),
    ("sampled", 2),
    ("digital", 2),
    ("smoothed", 2),
    ("cascaded", 2),
    ("moving_average", 2),
    ("moving_average", 3),
    ("sampled", 3),
    ("digital", 3),
    ("sampled", 4),
    ("digital", 4),
    ("fir", 8),
    ("fir", 16),
    ("fir", 32),
    ("fir", 64),
)
#: Cutoff beyond which nothing of the roll-off is left to see, in cycles per sample.
HIGHEST = {
    "sampled": 1.5,
    "digital": 0.49,
    "cascaded": 0.49,
    "smoothed": 0.49,
    "moving_average": 0.4,
    "fir": 0.6,
}
#: Lowest cutoff of filters that end: the mean of 4000 samples.
LOWEST = 1e-4
#: Poles nearer to zero are moved here, and equal ones so far apart: residues keep their digits, the filter its shape.
NEAR, APART = 1e-5, 2e-3
#: Half-power frequency of repeated means, times their length, by how many there are.
MEANS = {1: 0.442947, 2: 0.318936, 3: 0.261672}
#: Taps per sample of the output.
PHASES = 4


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def terms(design: str, order: int, cutoff: float) -> tuple[Term, ...]:
    """Autocovariance of white noise of variance 1 behind the filter."""
    if design in {"moving_average", "fir"}:
        if design == "moving_average" and order == 1:
            length = max(1.0, MEANS[1] / _bounded(cutoff))
            h = np.arange(int(np.ceil(length)))
            found: tuple[Term, ...] = (Lags(tuple(1.0 - h / length)),)
        else:
            taps = _taps(design, order, _bounded(cutoff))
            products = sum(np.correlate(t, t, "full")[t.size - 1 :] for t in taps)
            found = (Lags(tuple(np.asarray(products))),)
    elif design == "sampled":
        found = _sampled_terms(order, cutoff)
    else:
        found = _digital_terms(design, order, cutoff)
    at_zero = sum(float(t.spectrum(np.array([1e-9]))[0]) for t in found)
    return tuple(t.scaled(1.0 / at_zero) for t in found)


def generators(design: str, order: int, cutoff: float, white: float) -> Generators:
    """The core's generators of white noise of a variance behind the filter."""
    if design == "moving_average" and order == 1:
        # Between whole lengths the triangle of lags is a mean of those of both.
        length = max(1.0, MEANS[1] / _bounded(cutoff))
        low = int(length)
        share = length - low
        sizes = np.array([(1.0 - share) * low, share * (low + 1)]) * np.array([low, low + 1])
        sizes *= white / sizes.sum()
        parts = zip((low, low + 1), sizes, strict=True)
        return [("moving_average", [float(np.sqrt(v)), float(k)]) for k, v in parts if v > 0.0]
    if design in {"moving_average", "fir"}:
        taps = _taps(design, order, _bounded(cutoff))
        gain = np.sqrt(white / sum(float(t.sum()) ** 2 for t in taps))
        return [("finite", [float(gain * c) for c in t]) for t in taps]
    return [("filtered", [float(np.sqrt(white)), *_sections(*_roots(design, order, cutoff))])]


def response(design: str, order: int, cutoff: float) -> Response:
    """A filter of a recursive design, of gain 1 at frequency zero."""
    poles, zeros = _roots(design, order, cutoff)
    gain = np.prod(1.0 - poles) / np.prod(1.0 - zeros)
    return Response(float(gain.real), tuple(map(complex, zeros)), tuple(map(complex, poles)))


def _roots(design: str, order: int, cutoff: float) -> tuple[Poles, Poles]:
    """Poles and zeros of a recursive design."""
    if design == "sampled":
        poles = np.exp(2.0 * np.pi * cutoff * _butterworth(order))
        return poles, _sampled_zeros(order, cutoff, poles)
    zeros = np.full(order, 0.0 if design == "smoothed" else -1.0, dtype=complex)
    return _digital_poles(design, order, cutoff), zeros


def _bounded(cutoff: float) -> float:
    return float(np.clip(cutoff, LOWEST, 10.0))


def _butterworth(order: int) -> Poles:
    """Poles of the low-pass of cutoff 1 rad/s; conjugates are exact."""
    k = np.arange(order)
    out = np.exp(1j * np.pi * (2 * k + order + 1) / (2 * order))
    if order % 2:
        out[order // 2] = -1.0
    out[(order + 1) // 2 :] = out[: order // 2][::-1].conj()
    return out


def _modes(poles: Poles, weights: Poles) -> tuple[Term, ...]:
    """Σ weight·pole^h, of a conjugate pair one with twice its weight."""
    out: list[Term] = []
    for p, a in zip(poles, weights, strict=True):
        if p.imag >= 0.0:
            a = a * (2.0 if p.imag > 0.0 else 1.0)
            out.append(Exponential(complex(a), complex(p)))
    return tuple(out)


def _sampled_terms(order: int, cutoff: float) -> tuple[Term, ...]:
    """r(t) of the continuous low-pass at whole t, which has the aliases in it: residues of H(s)H(−s)."""
    s = _butterworth(order)
    weights = np.array([1.0 / (np.prod(p - s[s != p]) * np.prod(-p - s)) for p in s], dtype=complex)
    return _modes(np.exp(2.0 * np.pi * cutoff * s), weights)


def _digital_poles(design: str, order: int, cutoff: float) -> Poles:
    f = min(cutoff, 0.499)
    if design == "digital":
        # Away from a quarter of the rate, where an odd order has a pole at zero.
        k = np.tan(np.pi * (f if abs(f - 0.25) > NEAR / 4.0 else 0.25 - NEAR / 4.0))
        s = k * _butterworth(order)
        return np.asarray((1.0 + s) / (1.0 - s))
    # Each section takes its share of the half of the power.
    share = 0.5 ** (1.0 / order)
    if design == "cascaded":
        k = np.tan(np.pi * f) * np.sqrt(share / (1.0 - share))
        return np.asarray((1.0 - k) / (1.0 + k) + APART * np.array([-1, 1]) / (1.0 + k), complex)
    # (1−a)²/(1−2a cos w+a²) = share.
    rest = share * 2.0 * np.sin(np.pi * f) ** 2 / (1.0 - share)
    a = 1.0 / (1.0 + rest + np.sqrt(rest * (rest + 2.0)))
    spread = APART * (1.0 if order == 2 else 4.0) * np.linspace(-1.0, 1.0, order)
    return np.asarray(a * (1.0 + spread * min(1.0, (1.0 - a) / a)), dtype=complex)


def _digital_terms(design: str, order: int, cutoff: float) -> tuple[Term, ...]:
    """Residues of H(z)H(1/z) z^{h−1} at the poles, and the white rest at lag 0 where the zeros are at −1."""
    poles = _digital_poles(design, order, cutoff)
    top = (1.0 + poles) ** (2 * order) / poles if design != "smoothed" else poles ** (order - 1)
    weights = np.array(
        [
            t / (np.prod(p - poles[poles != p]) * np.prod(1.0 - p * poles))
            for p, t in zip(poles, top, strict=True)
        ]
    )
    modes = _modes(poles, weights)
    if design == "smoothed":
        return modes
    return (*modes, White(float((1.0 / np.prod(-poles)).real)))


def _sampled_zeros(order: int, cutoff: float, poles: Poles) -> Poles:
    """Zeros within the unit circle of the sampled low-pass: what its poles leave of its spectrum, aliases summed."""
    if order == 1:
        return np.zeros(1, dtype=complex)
    w = 2.0 * np.pi * np.arange(9) / 16.0
    alias = 2.0 * np.pi * np.arange(-4000, 4001)
    folded = np.add.outer(w, alias) / (2.0 * np.pi * cutoff)
    density = (1.0 / (1.0 + folded ** (2 * order))).sum(axis=1)
    for p in poles:
        density = density * np.abs(np.exp(1j * w) - p) ** 2
    g = np.fft.irfft(density)[:order]
    roots = np.roots(np.concatenate([g[:0:-1], g]))
    inside = roots[np.argsort(np.abs(roots))][: order - 1]
    return np.concatenate([inside, [0.0]])


def _sections(poles: Poles, zeros: Poles) -> list[float]:
    """b0, b1, b2, a1, a2 of sections in a row, each of gain 1 at frequency zero."""
    upper = [p for p in poles if p.imag > 0.0]
    real = [p for p in poles if p.imag == 0.0]
    pairs = [(p, p.conjugate()) for p in upper]
    pairs += [tuple(real[i : i + 2]) for i in range(0, len(real), 2)]
    # Conjugate zeros stay together.
    left = sorted(zeros, key=lambda z: (-abs(z.imag), z.real, z.imag))
    out: list[float] = []
    for pair in sorted(pairs, key=len, reverse=True):
        mine, left = left[: len(pair)], left[len(pair) :]
        b, a = np.real(np.poly(mine)), np.real(np.poly(pair))
        # 1 + a1 + a2 and the like from the roots: near 1 the sums have no digits.
        gain = np.prod([1.0 - p for p in pair]).real / np.prod([1.0 - z for z in mine]).real
        b, a = np.pad(gain * b, (0, 3 - b.size)), np.pad(a, (0, 3 - a.size))
        out += [*map(float, b), float(a[1]), float(a[2])]
    return out


@cleared_by_free_buffers
@lru_cache(maxsize=4096)
def _taps(design: str, order: int, cutoff: float) -> tuple[Array, ...]:
    """Impulse response at `PHASES` times the rate, one array for each phase of it."""
    if design == "moving_average":
        length = MEANS[order] / cutoff
        reach = 0.5 * order * length
        t = _instants(reach)
        x = t / length
        # B-splines of degree order − 1.
        if order == 2:
            response = np.maximum(1.0 - np.abs(x), 0.0)
        else:
            response = np.where(
                np.abs(x) < 0.5, 0.75 - x**2, 0.5 * np.maximum(1.5 - np.abs(x), 0.0) ** 2
            )
    else:
        t = _instants(0.5 * order)
        window = 0.54 + 0.46 * np.cos(2.0 * np.pi * t / order)
        here = np.cos(2.0 * np.pi * cutoff * t)
        # The middle of the edge is a little above the half-power frequency, by what the window's width says.
        low, high = 0.0, cutoff + 2.0 / order
        for _ in range(45):
            middle = 0.5 * (low + high)
            response = np.sinc(2.0 * middle * t) * window
            if response @ here < np.sqrt(0.5) * response.sum():
                low = middle
            else:
                high = middle
    response = np.pad(response, (0, -response.size % PHASES))
    return tuple(response[i::PHASES] for i in range(PHASES))


def _instants(reach: float) -> Array:
    """Instants at `PHASES` times the rate within a reach, even about zero."""
    count = max(1, int(np.floor(reach * PHASES)))
    return np.arange(-count, count + 1) / PHASES

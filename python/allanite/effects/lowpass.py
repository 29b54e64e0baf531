"""Low-pass filters of white noise: autocovariances as primitive terms, and the same filters for simulation.

Frequencies are in cycles per sample. Every filter has gain 1 at frequency zero.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.common.memory import cleared_by_free_buffers
from allanite.effects._declared import Array
from allanite.effects._filter import Response
from allanite.effects.terms import Exponential, Lags, Term, White

Poles = NDArray[np.complex128]
Generators = list[tuple[str, list[float]]]

#: Admissible orders of each design; for ``fir`` the length in samples.
DESIGNS: dict[str, tuple[int, ...]] = {
    "sampled": (1, 2, 3, 4),
    "digital": (1, 2, 3, 4),
    "cascaded": (2,),
    "smoothed": (2, 3),
    "moving_average": (1, 2, 3),
    "fir": (8, 12, 16, 24, 32, 48, 64),
}
#: Recursive designs (with poles), which can act on all random processes.
RECURSIVE = ("sampled", "digital", "cascaded", "smoothed")
#: Designs (name, order) that a fit tries, simpler ones first.
TRIED_DESIGNS = (
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
#: Maximum cutoff of each design in a fit, in cycles per sample; with a higher cutoff the roll-off is invisible.
#: Chosen by judgment; not measured.
MAX_CUTOFF = {
    "sampled": 1.5,
    "digital": 0.49,
    "cascaded": 0.49,
    "smoothed": 0.49,
    "moving_average": 0.4,
    "fir": 0.6,
}
#: Minimum cutoff of finite filters, in cycles per sample: that of a mean of 4000 samples. Chosen by judgment; not measured.
MIN_CUTOFF = 1e-4
#: Minimum distance of a pole from zero, so that residues keep their digits. Chosen by judgment; not measured.
MIN_POLE = 1e-5
#: Relative distance by which equal poles are moved apart, so that all poles differ. The filter hardly changes. Chosen by
#: judgment; not measured.
POLE_SEPARATION = 2e-3
#: Half-power frequency times length of one, two and three equal means in a row: solutions of sinc(x)^2k = ½.
MEAN_CUTOFFS = {1: 0.442947, 2: 0.318936, 3: 0.261672}
#: Number of aliases to each side of the spectrum of a sampled filter that are added one by one. The sum of all others is
#: off by less than 10⁻¹² of the density, up to the highest cutoff of a fit (1.5).
SUMMED_ALIASES = 100
#: Number of taps per output sample in the impulse response of finite filters. Chosen by judgment; not measured.
TAPS_PER_SAMPLE = 4


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def terms(design: str, order: int, cutoff: float) -> tuple[Term, ...]:
    """Terms of white noise after a low-pass (see `DESIGNS`), with spectrum 1 at frequency zero; cached."""
    if design in {"moving_average", "fir"}:
        if design == "moving_average" and order == 1:
            length = max(1.0, MEAN_CUTOFFS[1] / _clipped_cutoff(cutoff))
            h = np.arange(int(np.ceil(length)))
            found: tuple[Term, ...] = (Lags(tuple(1.0 - h / length)),)
        else:
            taps = _polyphase_taps(design, order, _clipped_cutoff(cutoff))
            products = sum(np.correlate(t, t, "full")[t.size - 1 :] for t in taps)
            found = (Lags(tuple(np.asarray(products))),)
    elif design == "sampled":
        found = _sampled_terms(order, cutoff)
    else:
        passed = response(design, order, cutoff)
        found = tuple(Exponential(weight, pole) for pole, weight in passed.modes)
        found += (White(passed.lag_zero),) if passed.lag_zero else ()
    at_zero = sum(float(t.spectrum(np.array([1e-9]))[0]) for t in found)
    return tuple(t.scaled(1.0 / at_zero) for t in found)


def generators(design: str, order: int, cutoff: float, white: float) -> Generators:
    """Generators (name, parameters) of the compiled core whose outputs add up to low-pass filtered white noise.

    `white` is the variance of a sample before the filter. A recursive design is one generator. A moving average of one
    stage with a fractional length is the sum of two, and other finite filters are the sum of several.
    """
    if design == "moving_average" and order == 1:
        # For a fractional length, mix the means of the two neighboring whole lengths.
        length = max(1.0, MEAN_CUTOFFS[1] / _clipped_cutoff(cutoff))
        low = int(length)
        share = length - low
        sizes = np.array([(1.0 - share) * low, share * (low + 1)]) * np.array([low, low + 1])
        sizes *= white / sizes.sum()
        parts = zip((low, low + 1), sizes, strict=True)
        return [("moving_average", [float(np.sqrt(v)), float(k)]) for k, v in parts if v > 0.0]
    if design in {"moving_average", "fir"}:
        taps = _polyphase_taps(design, order, _clipped_cutoff(cutoff))
        gain = np.sqrt(white / sum(float(t.sum()) ** 2 for t in taps))
        return [("finite", [float(gain * c) for c in t]) for t in taps]
    from scipy.signal import zpk2sos

    passed = response(design, order, cutoff)
    # Each section is b0, b1, b2, a0, a1, a2 with a0 = 1, which the core does not take.
    sections = zpk2sos(passed.zeros, passed.poles, passed.gain)  # type: ignore[arg-type]
    numbers = sections[:, [0, 1, 2, 4, 5]].ravel().tolist()
    return [("filtered", [float(np.sqrt(white)), *numbers])]


def response(design: str, order: int, cutoff: float) -> Response:
    """`Response` of a recursive design with gain 1 at frequency zero; cutoff in cycles per sample."""
    poles, zeros = _poles_and_zeros(design, order, cutoff)
    gain = np.prod(1.0 - poles) / np.prod(1.0 - zeros)
    return Response(float(gain.real), tuple(map(complex, zeros)), tuple(map(complex, poles)))


def _poles_and_zeros(design: str, order: int, cutoff: float) -> tuple[Poles, Poles]:
    """Pair of arrays: poles and zeros of a recursive design at a cutoff in cycles per sample."""
    if design == "sampled":
        poles = np.exp(2.0 * np.pi * cutoff * _butterworth_poles(order))
        return poles, _sampled_zeros(order, cutoff, poles)
    zeros = np.full(order, 0.0 if design == "smoothed" else -1.0, dtype=complex)
    return _digital_poles(design, order, cutoff), zeros


def _clipped_cutoff(cutoff: float) -> float:
    """The `cutoff` frequency (cycles per sample), clipped to 0.0001 … 10 cycles per sample."""
    return float(np.clip(cutoff, MIN_CUTOFF, 10.0))


def _butterworth_poles(order: int) -> Poles:
    """Array of the poles of the continuous Butterworth low-pass with cutoff 1 rad/s, in exact conjugate pairs."""
    return np.asarray(-np.exp(0.5j * np.pi * np.arange(1 - order, order, 2) / order))


def _sampled_terms(order: int, cutoff: float) -> tuple[Term, ...]:
    """Terms of white noise after a continuous Butterworth low-pass, sampled (with aliases); not normalized.

    The weights are residues of H(s)H(−s). A conjugate pair of poles is one term with twice the weight.
    """
    s = _butterworth_poles(order)
    return tuple(
        Exponential(
            complex((2.0 if p.imag else 1.0) / (np.prod(p - s[s != p]) * np.prod(-p - s))),
            complex(np.exp(2.0 * np.pi * cutoff * p)),
        )
        for p in s[s.imag >= 0.0]
    )


def _digital_poles(design: str, order: int, cutoff: float) -> Poles:
    """Poles of a digital, cascaded or smoothed design, equal ones moved slightly apart (`POLE_SEPARATION`)."""
    f = min(cutoff, 0.499)
    if design == "digital":
        # Avoid a cutoff of a quarter of the rate, where odd orders have a pole at zero.
        k = np.tan(np.pi * (f if abs(f - 0.25) > MIN_POLE / 4.0 else 0.25 - MIN_POLE / 4.0))
        s = k * _butterworth_poles(order)
        return np.asarray((1.0 + s) / (1.0 - s))
    # Power gain of each section at the cutoff, so that all together have ½.
    share = 0.5 ** (1.0 / order)
    if design == "cascaded":
        k = np.tan(np.pi * f) * np.sqrt(share / (1.0 - share))
        return np.asarray(
            (1.0 - k) / (1.0 + k) + POLE_SEPARATION * np.array([-1, 1]) / (1.0 + k), complex
        )
    # (1−a)²/(1−2a cos w+a²) = share.
    rest = share * 2.0 * np.sin(np.pi * f) ** 2 / (1.0 - share)
    a = 1.0 / (1.0 + rest + np.sqrt(rest * (rest + 2.0)))
    spread = POLE_SEPARATION * (1.0 if order == 2 else 4.0) * np.linspace(-1.0, 1.0, order)
    return np.asarray(a * (1.0 + spread * min(1.0, (1.0 - a) / a)), dtype=complex)


def _sampled_zeros(order: int, cutoff: float, poles: Poles) -> Poles:
    """Zeros, inside the unit circle, of a digital filter with the spectrum of a sampled continuous Butterworth low-pass."""
    if order == 1:
        return np.zeros(1, dtype=complex)
    from scipy.special import zeta

    f = np.arange(9) / 16.0
    aliases = np.arange(-SUMMED_ALIASES, SUMMED_ALIASES + 1)
    folded = np.add.outer(f, aliases) / cutoff
    density = (1.0 / (1.0 + folded ** (2 * order))).sum(axis=1)
    # The other aliases are (cutoff/f)^(2·order) up to a factor 1 − (cutoff/f)^(2·order).
    others = sum(zeta(2 * order, SUMMED_ALIASES + 1 + side * f) for side in (-1.0, 1.0))
    density += cutoff ** (2 * order) * others
    w = 2.0 * np.pi * f
    for p in poles:
        density = density * np.abs(np.exp(1j * w) - p) ** 2
    g = np.fft.irfft(density)[:order]
    roots = np.roots(np.concatenate([g[:0:-1], g]))
    inside = roots[np.argsort(np.abs(roots))][: order - 1]
    return np.concatenate([inside, [0.0]])


@cleared_by_free_buffers
@lru_cache(maxsize=4096)
def _polyphase_taps(design: str, order: int, cutoff: float) -> tuple[Array, ...]:
    """Polyphase components of the impulse response of an FIR low-pass at four times the rate; cached.

    Component i has the values i, i + 4, i + 8, …; all four have the same length.
    """
    if design == "moving_average":
        length = MEAN_CUTOFFS[order] / cutoff
        reach = 0.5 * order * length
        t = _tap_times(reach)
        x = t / length
        # B-splines of degree order − 1.
        if order == 2:
            response = np.maximum(1.0 - np.abs(x), 0.0)
        else:
            response = np.where(
                np.abs(x) < 0.5, 0.75 - x**2, 0.5 * np.maximum(1.5 - np.abs(x), 0.0) ** 2
            )
    else:
        t = _tap_times(0.5 * order)
        window = 0.54 + 0.46 * np.cos(2.0 * np.pi * t / order)
        here = np.cos(2.0 * np.pi * cutoff * t)
        # Bisection for the cutoff of the sinc whose windowed response has half power at the wanted cutoff.
        low, high = 0.0, cutoff + 2.0 / order
        for _ in range(45):
            middle = 0.5 * (low + high)
            response = np.sinc(2.0 * middle * t) * window
            if response @ here < np.sqrt(0.5) * response.sum():
                low = middle
            else:
                high = middle
    response = np.pad(response, (0, -response.size % TAPS_PER_SAMPLE))
    return tuple(response[i::TAPS_PER_SAMPLE] for i in range(TAPS_PER_SAMPLE))


def _tap_times(reach: float) -> Array:
    """Array of the times of FIR taps from −reach to reach, in samples, in steps of 1/`TAPS_PER_SAMPLE`."""
    count = max(1, int(np.floor(reach * TAPS_PER_SAMPLE)))
    return np.arange(-count, count + 1) / TAPS_PER_SAMPLE

"""Wandering line: a line whose frequency wanders, such as the mains or an idling engine."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Stochastic
from allanite.effects._declared import Array, Parameter, frequency_parameter, texts_for_clocks
from allanite.effects.resonance import Resonance
from allanite.effects.terms import Exponential, Term

if TYPE_CHECKING:
    from allanite.effects._base import Effect
    from allanite.effects.model import Model

#: Distance from the middle within which half of the power lies, in standard deviations of a normal distribution.
QUARTILE = 0.6744897501960817
#: Coefficients of 1 + u + u²/2 + u³/6 with u = x²/2, by rising powers of x: the reciprocal of the density.
RECIPROCAL = np.polynomial.Polynomial([1.0, 0.0, 1.0 / 2.0, 0.0, 1.0 / 8.0, 0.0, 1.0 / 48.0])
#: Poles x of the density in the upper half-plane.
POLES = tuple(x for x in map(complex, RECIPROCAL.roots().tolist()) if x.imag > 0.0)
#: Integral of the density over x, divided by 2π.
WHOLE = float(sum(1j / RECIPROCAL.deriv()(x) for x in POLES).real)
#: Maximum relative error of the density near the middle of a simulated line with the exact zeros.
MAX_GENERATOR_ERROR = 1e-3
#: Shares of the poles in the autocovariance at lag 0; they sum to 1.
SHARES = tuple(complex(1j / RECIPROCAL.deriv()(x) / WHOLE) for x in POLES)
#: Minimum width of the band, in 1/T. A narrower one may be a few lines. Half or twice this value
#: names the same 20 hidden bands (benches/decisions/chosen_values.py bands). Chosen by judgment.
MIN_RESOLVED_FREQUENCIES = 10.0
#: Maximum wander of a line relative to its frequency; a broader hump is no line. An idling engine wanders by a few per
#: cent. Half or twice this value names the same 20 hidden bands (chosen_values.py bands). Chosen by judgment.
MAX_RELATIVE_WANDER = 0.1
#: Standard deviations within which the frequency remains: it exceeds them for 6·10⁻⁷ of the time.
MAX_DEVIATIONS = 5.0
#: Half of the power of the density lies within this distance x: the integral of the density from −x to x, computed
#: numerically, is half of that over all x.
QUARTILE_OF_SHAPE = 0.7103377834276361


@dataclass(frozen=True)
class WanderingLine(Stochastic):
    """A line whose frequency wanders normally about f with the standard deviation w; rms² is its power.

    The density at f + δ is proportional to 1/(1 + u + u²/2 + u³/6) with u = δ²/(2w²), up to a factor of 1.05 in w. This is
    the normal distribution of the frequency, with tails of a line whose phase changes smoothly. An m-th harmonic wanders
    m times as far.

    References
    ----------
    Kubo, R. (1969). A stochastic theory of line shape. Adv. Chem. Phys. 15, 101.

    Examples
    --------
    >>> engine = al.effects.WanderingLine(frequency=11.3, wander=0.3, rms=0.1)
    >>> f = np.array([11.0, 11.3, 11.6, 12.8])
    >>> print((engine.psd(f, rate=100) / engine.psd(11.3, rate=100)).round(3))
    [0.576 1.    0.576 0.002]
    """

    frequency: float | None = None
    wander: float | None = None
    rms: float | None = None

    kind = "wandering_line"
    short = "WLINE"
    catalog_place = 16
    title = "wandering line"
    family = "band"
    found_with = "resonance"
    coefficient = "rms"
    parameters = (
        frequency_parameter("mean frequency"),
        Parameter("wander", "Hz", "standard deviation of the frequency", "shape", low=1e-12),
        Parameter("rms", 0.0, "standard deviation of the samples"),
    )
    legend = ("frequency", "wander", "rms")
    physics = "something turns or hums at a frequency that is not constant: an idling engine, a fan, the mains"
    looks_like = "a narrow band of the spectrum with steep sides, of the same relative width at all harmonics"
    check_by = "switch the machine off; log its speed: multiples of its frequency wander in proportion, on all axes"
    texts = texts_for_clocks(
        physics="something modulates the frequency of the clock at a rate that is not constant, such as a compressor",
        check_by="switch the machine off, or log its speed: the line must follow",
    )
    rivals = ("resonance", "sinusoid")

    @classmethod
    def like(cls, other: Effect, **values: Any) -> Self | None:
        """Wandering line with the middle, the half-power width and the power of the resonance `other`.

        None if `other` is not exactly a `Resonance` with free shapes, or if there are `values`.
        """
        if type(other) is not Resonance or values or other.occupies is None or other.limits:
            return None
        return cls(rms=other.rms).banded(*other.occupies) if not other.held else None

    def as_resonance(self) -> Resonance:
        """Resonance with the power and the half-power band of the line; a `Resonance` without values for a line without."""
        resonance = Resonance(rms=self.rms)
        return resonance if self.occupies is None else resonance.banded(*self.occupies)

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values of the parameter `name` to try: eight wanders from 2/T (T: duration) to rate/40, or frequencies."""
        if name == "wander":
            return np.geomspace(2.0 * rate / n, max(4.0 * rate / n, rate / 40.0), 8)
        return Resonance().grid(name, n, rate)

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (low, high), Hz: the band that has half of the power, 0.67 standard deviations to each side; or None."""
        if self.frequency is None or self.wander is None:
            return None
        half = QUARTILE * self.wander
        return self.frequency - half, self.frequency + half

    @property
    def unsteady(self) -> tuple[float, float] | None:
        """Pair (low, high), Hz: five standard deviations to each side of the frequency; None without values."""
        if self.frequency is None or self.wander is None:
            return None
        reach = MAX_DEVIATIONS * self.wander
        return max(0.0, self.frequency - reach), self.frequency + reach

    def banded(self, low: float, high: float) -> Self:
        """Copy that has half of its power between `low` and `high` Hz."""
        return self.with_values(frequency=0.5 * (low + high), wander=0.5 * (high - low) / QUARTILE)

    def shows(self, model: Model, rate: float, duration: float) -> bool:
        """True if half of the power has a band wider than 10/`duration`, and the wander is at most 0.1 of the frequency.

        A narrower peak cannot be told from a few lines; `duration` is in s. Machines do not wander further. `model` and
        `rate` are not used.
        """
        f, wander = self.frequency or 0.0, self.wander or 0.0
        wide = 2.0 * QUARTILE * wander * duration > MIN_RESOLVED_FREQUENCIES
        return wide and wander <= MAX_RELATIVE_WANDER * f

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Three complex exponentials, whose sum has variance 1; by default at 1 Hz with the wander 0.1 Hz."""
        middle, wander = self.frequency or 1.0, self.wander or 0.1
        turns = self._turns(rate, middle, wander)
        return tuple(Exponential(a, cmath.exp(turn)) for a, turn in zip(SHARES, turns, strict=True))

    def generator(self, rate: float) -> tuple[str, list[float]]:
        """Pair ("filtered", parameters) of the core's generator: three resonators in series.

        The zeros are those of the sampled process if its spectrum near the line is then right within 0.1 %; rounding
        spoils them if the line is narrow or slow. Otherwise a second set is tried, in which a real zero of each
        resonator compensates the slope at the line that comes from the poles at negative frequency. If neither is right
        within 0.1 %, as near 0 Hz and half the rate, the better one is scaled to the exact variance.
        """
        from scipy.signal import zpk2sos

        middle, wander = self.frequency or 1.0, self.wander or 0.1
        poles = np.exp(self._turns(rate, middle, wander))
        near = np.array([middle - wander, middle, middle + wander])
        goal = self.squared_coefficient * _density(near, middle, wander, rate)
        slope = math.tan(math.pi / 4.0 - math.pi * middle / rate)
        both = np.concatenate([poles, poles.conj()])
        z = np.exp(2j * np.pi * near / rate)[:, None]
        choices: list[tuple[float, float, Any]] = []
        for zeros in (_zeros(poles, middle, wander, rate), np.full(poles.size, slope)):
            made = np.prod(np.abs(z - zeros), axis=1) ** 2 / np.prod(np.abs(z - both), axis=1) ** 2
            ratio = goal / made
            choices.append((float(np.ptp(ratio) / ratio[1]), float(ratio[1]), zeros))
            if choices[-1][0] < MAX_GENERATOR_ERROR:
                break
        error, squared, zeros = min(choices, key=lambda one: one[0])
        if error >= MAX_GENERATOR_ERROR:
            # Near 0 Hz or half the rate the shape is approximate; the variance is exact.
            squared = self.squared_coefficient / _variance(zeros, both)
        sections = zpk2sos(zeros, both, 1.0)[:, [0, 1, 2, 4, 5]]
        return "filtered", [math.sqrt(squared), *map(float, sections.ravel())]

    @staticmethod
    def _turns(rate: float, middle: float, wander: float) -> list[complex]:
        """List of ln φ of the three exponentials of a line with this middle and wander, Hz, sampled at `rate` Hz."""
        scale = wander * QUARTILE / QUARTILE_OF_SHAPE
        return [2.0j * math.pi / rate * (middle + scale * x) for x in POLES]


def _density(f: Array, middle: float, wander: float, rate: float) -> Array:
    """Array of the spectrum, per sample, of a line with variance 1 sampled at `rate`, at each f, Hz: a sum over aliases."""
    scale = wander * QUARTILE / QUARTILE_OF_SHAPE
    centers = [k * rate + s * middle for k in range(-3, 4) for s in (-1.0, 1.0)]
    total = np.sum([1.0 / RECIPROCAL((f - center) / scale) for center in centers], axis=0)
    return np.asarray(total * rate / (4.0 * np.pi * scale * WHOLE))


def _variance(zeros: NDArray[np.complex128], poles: NDArray[np.complex128]) -> float:
    """Variance of white noise of variance 1 behind a filter with more poles than zeros, from its impulse response."""
    apart = poles[:, None] - poles + np.eye(poles.size)
    parts = np.prod(poles[:, None] - zeros, axis=1) / np.prod(apart, axis=1)
    return float(np.real(parts @ (1.0 / (1.0 - np.outer(poles, poles))) @ parts))


def _zeros(
    poles: NDArray[np.complex128], middle: float, wander: float, rate: float
) -> NDArray[np.complex128]:
    """Array of the zeros of the filter, with the `poles` and their conjugates, that makes the line of white noise."""
    # The spectrum times that of the poles is the spectrum of a moving average, from which its autocovariance follows.
    count = 2 * poles.size
    w = np.pi * np.arange(1, 4 * count + 2, 2) / (4 * count + 2)
    z = np.exp(1j * w)[:, None]
    moving = _density(0.5 * rate * w / np.pi, middle, wander, rate)
    moving = moving * np.prod(np.abs(z - poles) * np.abs(z - poles.conj()), axis=1) ** 2
    lags = np.cos(np.outer(np.arange(count), w)) @ moving / w.size
    roots = np.roots(np.concatenate([lags[:0:-1], lags]))
    zeros = np.array(sorted(roots, key=abs)[: count - 1])
    # Pairs of conjugates.
    return np.asarray(np.roots(np.real(np.poly(zeros))), dtype=np.complex128)

"""Bandwidth: the white part has passed a low-pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects._base import Modifier, Parameter
from allanite.effects.terms import Exponential, MovingAverage, Term, White

#: (design, order) in the order in which they are tried; the simpler first.
DESIGNS = (("sampled", 1), ("sampled", 2), ("digital", 1), ("digital", 2), ("moving_average", 1))


@dataclass(frozen=True)
class Bandwidth(Modifier):
    """White noise through |H(f)|² of a low-pass; N stays its level at low frequency.

    Designs: ``sampled`` a continuous first-order lag or second-order Butterworth low-pass before the sampler, aliases
    included; ``digital`` the same by bilinear transform at the sampling rate (zero at Nyquist); ``moving_average`` a mean
    of L samples, L = 0.443·rate/cutoff.
    """

    cutoff: float | None = None
    order: float | None = None
    design: str | None = None

    kind: ClassVar[str] = "bandwidth"
    short: ClassVar[str] = "BW"
    title: ClassVar[str] = "bandwidth"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "cutoff", "Hz", "−3 dB frequency", "shape", low=1e-12, aliases=("f", "fc"), symbol="f"
        ),
        Parameter("order", "1", "order of the low-pass: 1 or 2", "choice", low=1, high=2),
        Parameter("design", "text", "sampled, digital or moving_average", "choice"),
    )
    single: ClassVar[bool] = True
    physics: ClassVar[str] = (
        "the sensor's own digital or anti-alias filter, or the mechanical response, rolls off the white noise"
    )
    looks_like: ClassVar[str] = (
        "a density that falls towards Nyquist; the Allan curve bends down at the first τ"
    )
    check_by: ClassVar[str] = (
        "compare with the filter setting of the data sheet; set the sensor to another bandwidth or output rate"
    )
    rivals: ClassVar[tuple[str, ...]] = ("gauss_markov", "resonance")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.design is not None and self.design not in {d for d, _ in DESIGNS}:
            raise InputError(
                f"bandwidth: design {self.design!r} (known: sampled, digital, moving_average)"
            )

    def variants(self) -> tuple[Bandwidth, ...]:
        """The designs to try: all that agree with what is given."""
        return tuple(
            self.with_values(design=design, order=float(order))
            for design, order in DESIGNS
            if self.design in (None, design) and self.order in (None, order)
        )

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """Cutoffs from a hundredth of the rate to where nothing of the roll-off is left to see."""
        if self.design == "moving_average":
            return 0.443 * rate / np.arange(32, 1, -1)
        return np.geomspace(0.01 * rate, (0.49 if self.design == "digital" else 1.5) * rate, 24)

    def modify(
        self,
        white: float,
        rate: float,
        span: tuple[float, float] | None = None,
    ) -> tuple[Term, ...]:
        """Autocovariance of the filtered noise, normalised to `white` at zero frequency."""
        cutoff = self.cutoff or rate
        second = (self.order or 1.0) >= 2.0
        if self.design == "moving_average":
            return (MovingAverage(white, float(max(1, round(0.443 * rate / cutoff)))),)
        terms = (_digital if self.design == "digital" else _sampled)(cutoff / rate, second)
        at_zero = sum(float(t.spectrum(np.array([1e-9]))[0]) for t in terms)
        return tuple(t.scaled(white / at_zero) for t in terms)


def _sampled(f: float, second: bool) -> tuple[Term, ...]:
    """r(t) of a continuous low-pass at integer t; `f` in cycles per sample."""
    w = 2.0 * np.pi * f
    if not second:
        return (Exponential(1.0, float(np.exp(-w))),)
    # Butterworth: r(t) ∝ e^{−wt/√2}(cos + sin)(wt/√2).
    phi = np.exp((-1 + 1j) * w / np.sqrt(2.0))
    return (Exponential(1.0 - 1.0j, complex(phi)),)


def _digital(f: float, second: bool) -> tuple[Term, ...]:
    """Bilinear Butterworth: residues of H(z)H(1/z) at its poles, and the white rest at lag 0."""
    k = float(np.tan(np.pi * min(f, 0.499)))
    if not second:
        a = (1.0 - k) / (1.0 + k)
        a = a if abs(a) > 1e-6 else 1e-6
        g = (k / (1.0 + k)) ** 2
        return (Exponential(g * (1 + a) / (a * (1 - a)), a), White(-g / a))
    s = k * np.exp(1j * np.pi * 0.75)
    p = (1.0 + s) / (1.0 - s)
    g = (k**2 / abs(1.0 - s) ** 2) ** 2
    a2 = 2.0 * g * (1 + p) ** 4 / (p * (p - p.conjugate()) * (1 - p**2) * (1 - abs(p) ** 2))
    return (
        Exponential(complex(a2), complex(p)),
        White(g / abs(p) ** 2),
    )

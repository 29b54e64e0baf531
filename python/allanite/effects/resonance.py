"""Resonance: a second-order peak driven by white noise."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._declared import Array, Parameter, frequency_parameter, texts_for_clocks
from allanite.effects.terms import Exponential, Term

if TYPE_CHECKING:
    from allanite.effects.model import Model

#: Minimum width of a band times the duration of the record for a resonance; narrower bands are lines. In a record of
#: duration T, ordinates are 1/(2T) apart and lines 1/T wide. Chosen by judgment; not measured.
MIN_WIDTH_TIMES_DURATION = 2.0

#: Minimum damping ratio of a mode of a structure or mount. A narrower band is a line whose phase wanders: if the phase is
#: a random walk, the band is Lorentzian like a resonance. Chosen by judgment; not measured.
MIN_MODE_DAMPING = 1e-3


@dataclass(frozen=True)
class Resonance(Stochastic):
    """r(t) = rms² e^{−ζω0t}(cos ω_d t + ζω0/ω_d sin ω_d t), ω_d = ω0 √(1−ζ²).

    The density has its maximum at f √(1−2ζ²). From ζ = 1/√2 on it has no maximum and equals noise after a second-order
    low-pass; therefore ζ is limited to 0.7.

    References
    ----------
    Wang, M. C. & Uhlenbeck, G. E. (1945). On the theory of the Brownian motion II. Rev. Mod. Phys. 17, 323.

    Examples
    --------
    >>> mount = al.effects.Resonance(frequency=20.0, damping=0.05, rms=0.1)
    >>> f = np.linspace(1.0, 49.0, 97)
    >>> print(f[np.argmax(mount.psd(f, rate=100))].round())
    20.0
    """

    frequency: float | None = None
    damping: float | None = None
    rms: float | None = None

    kind = "resonance"
    short = "RES"
    catalog_place = 13
    common = True
    title = "resonance"
    family = "band"
    coefficient = "rms"
    # Annotated, because a modulated vibration has more of each.
    parameters: ClassVar[tuple[Parameter, ...]] = (
        frequency_parameter("natural frequency"),
        Parameter(
            "damping", "1", "damping ratio ζ", "shape", low=1e-9, high=0.7, aliases=("zeta",)
        ),
        Parameter("rms", 0.0, "standard deviation of the process"),
    )
    legend: ClassVar[tuple[str, ...]] = ("frequency", "rms")
    physics = (
        "a mode of the structure, mount, pendulum or proof mass, excited by ambient vibration; a very narrow band is"
        " a line whose phase wanders, such as a machine or the mains"
    )
    looks_like = "a band of the spectrum of width 2ζf; damped lobes of the Allan deviation"
    check_by = (
        "tap the mount and look for a ringing at f; add mass or damping: the band must move or widen; a machine has"
        " multiples of f, and can be switched off"
    )
    texts = texts_for_clocks(
        physics="a band of frequency noise: the locking or steering loop peaks there, or the supply modulates the clock",
        check_by="change the bandwidth of the loop, the supply or the place: the band must move or shrink",
    )
    rivals: ClassVar[tuple[str, ...]] = ("sinusoid", "gauss_markov", "bandwidth", "quantization")

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values of the parameter `name` to try: four damping ratios from 0.01 to 0.35, or frequencies, Hz.

        Frequencies run from 20/T (T: duration of the record) to 0.48 of the rate, about 10 % apart. If the damping has
        a value below 0.077, they are 1.3 times the damping apart, at least 2.5 %, so that no peak is missed.
        """
        if name == "damping":
            return np.array([0.01, 0.03, 0.1, 0.35])
        low, high = 20.0 * rate / n, 0.48 * rate
        apart = 0.1 if self.damping is None else float(np.clip(1.3 * self.damping, 0.025, 0.1))
        return np.geomspace(low, high, max(4, int(np.log(high / low) / apart)))

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (low, high), Hz: the band within one half-width ζf of the frequency, with half of the power; or None."""
        if self.frequency is None or self.damping is None:
            return None
        half = self.damping * self.frequency
        return self.frequency - half, self.frequency + half

    def banded(self, low: float, high: float) -> Resonance:
        """Copy whose half-power band is `low` … `high` Hz; its damping is limited to the maximum of 0.7."""
        middle, widest = 0.5 * (low + high), self.parameter("damping").high
        return self.with_values(frequency=middle, damping=min(0.5 * (high - low) / middle, widest))

    def shows(self, model: Model, rate: float, duration: float) -> bool:
        """True if the half-power width of the resonance, 2·damping·frequency, is above 2/`duration`; `duration` is in s.

        A narrower peak cannot be told from a line. `model` and `rate` are not used.
        """
        return (
            2.0 * (self.damping or 0.0) * (self.frequency or 0.0) * duration
            > MIN_WIDTH_TIMES_DURATION
        )

    def name_for(self, kind: str = "") -> str:
        """Display name for a `kind` of sensor; "line with wandering phase" for a damping below 0.001.

        A mode of a structure does not ring for the 160 periods of such a damping.
        """
        narrow = type(self) is Resonance and 0.0 < (self.damping or 0.0) < MIN_MODE_DAMPING
        return "line with wandering phase" if narrow else super().name_for(kind)

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """One complex exponential with variance 1; without values the frequency is 1 Hz and the damping 0.1."""
        return oscillations([self.frequency or 1.0], self.damping or 0.1, rate)


def oscillations(
    frequencies: Sequence[float], damping: float, rate: float, variance: float = 1.0
) -> tuple[Term, ...]:
    """Damped oscillation (`Exponential`) of this `variance` and damping ratio for each natural frequency, Hz."""
    root = math.sqrt(1.0 - damping**2)
    turn = complex(-damping, root) * 2.0 * math.pi / rate
    a = complex(variance, -variance * damping / root)
    return tuple(Exponential(a, cmath.exp(turn * f)) for f in frequencies)

"""Modulated vibration: a band with sidebands, because its strength changes periodically."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from allanite.effects._declared import Array, Parameter, texts_for_clocks
from allanite.effects.resonance import Resonance, oscillations
from allanite.effects.wandering_line import WanderingLine

if TYPE_CHECKING:
    from allanite.effects._base import Effect
    from allanite.effects.terms import Term


@dataclass(frozen=True)
class ModulatedVibration(Resonance):
    """A resonance times 1 + m cos(2πf_m t + φ): a carrier at f, and sidebands at f ± f_m with ¼m² of its power each.

    r(t) = rms² Σ s_i ρ_i(t) with ρ_i the correlations of equally wide resonances at f, f − f_m, f + f_m, and
    s = (1, ¼m², ¼m²)/(1 + ½m²). A speed that oscillates by ±Δf at the rate f_m has the same sidebands with m = Δf/f_m, if m
    is small.

    References
    ----------
    Randall, R. B. (2011). Vibration-based Condition Monitoring. Wiley, section 3.3.

    Examples
    --------
    >>> pump = al.effects.ModulatedVibration(frequency=9.0, damping=1e-3, rms=0.1, modulation=0.5, depth=1.0)
    >>> f = np.array([8.5, 8.75, 9.0, 9.5])
    >>> print((pump.psd(f, rate=100) / pump.psd(9.0, rate=100)).round(2))
    [0.25 0.   1.   0.25]
    """

    modulation: float | None = None
    depth: float | None = None

    kind = "modulated_vibration"
    short = "MOD"
    catalog_place = 14
    title = "modulated vibration"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "modulated band"}
    screened = "none"
    companions = ("modulation", "depth")
    parameters = (
        *Resonance.parameters,
        Parameter(
            "modulation",
            "Hz",
            "rate of the modulation: distance of the sidebands",
            "shape",
            low=1e-12,
            aliases=("fm",),
            symbol="f_m",
        ),
        Parameter(
            "depth", "1", "depth of the modulation m", "shape", low=1e-6, high=5.0, aliases=("m",)
        ),
    )
    legend = ("frequency", "modulation", "rms")
    physics = "a machine of periodic load or speed: a pump, a fan or a gear, or two machines of nearly equal speed"
    looks_like = "a narrow band of the spectrum with weaker bands at equal distances on both sides"
    check_by = (
        "look for something that changes with the rate f_m; multiples of the band have sidebands at the same distance;"
        " switch it off"
    )
    texts = texts_for_clocks(
        physics="a periodic disturbance whose strength changes periodically, such as two regulators of nearly equal speed"
    )
    rivals = ("resonance",)

    @classmethod
    def like(cls, other: Effect, **values: Any) -> Self | None:
        """Modulated vibration whose carrier is the resonance or wandering line `other`: the same band, power and limits.

        `values` are the ``modulation`` (Hz) and the ``depth``. None for other `values` or another kind of `other`.
        """
        if isinstance(other, WanderingLine):
            other = other.as_resonance()
        if not isinstance(other, Resonance) or isinstance(other, cls):
            return None
        if values.keys() != {*cls.companions}:
            return None
        more_power = 1.0 + 0.5 * values["depth"] ** 2
        rms = None if other.rms is None else other.rms * float(np.sqrt(more_power))
        return cls(
            other.frequency, other.damping, rms, **values, hold=other.hold, limits=other.limits
        )

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of values to try: one depth, six modulation rates (Hz), or the grid of a resonance."""
        if name == "depth":
            return np.array([0.5])
        if name == "modulation":
            return np.geomspace(40.0 * rate / n, 0.05 * rate, 6)
        return super().grid(name, n, rate)

    @property
    def peaks(self) -> tuple[tuple[float, float], ...]:
        """Limits (low, high), Hz, of the carrier, the lower and the upper sideband, which are equally wide.

        Without a modulation frequency, only the carrier; empty without a frequency.
        """
        if self.occupies is None or self.modulation is None:
            return super().peaks
        low, high = self.occupies
        return tuple((low + s, high + s) for s in (0.0, -self.modulation, self.modulation))

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Three exponentials, for the carrier and two sidebands, with total variance 1; without values as a resonance."""
        part = 0.25 * (self.depth or 0.0) ** 2
        shares = [one / (1.0 + 2.0 * part) for one in (1.0, part, part)]
        if self.occupies is None or self.modulation is None:
            return super().unit_terms(rate)
        widest = self.parameter("damping").high
        found: list[Term] = []
        for share, (low, high) in zip(shares, self.peaks, strict=True):
            # A sideband below 0 Hz appears at its mirror frequency.
            middle = abs(0.5 * (low + high))
            damping = min(0.5 * (high - low) / middle, widest)
            found += oscillations([middle], damping, rate, share)
        return tuple(found)

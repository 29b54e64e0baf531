"""Flicker phase noise F: flicker noise of the integral, flicker PM of a clock (IEEE 1139-2008)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter
from allanite.effects.terms import PowerLaw as PowerLawTerm
from allanite.effects.terms import Term


@dataclass(frozen=True)
class FlickerPhase(Stochastic):
    """S(f) = F² 2πf: differences of a phase with the density F²/(2πf); h₁ = 4πF².

    References
    ----------
    IEEE 1139-2008, annex B. Discrete form: Kasdin, N. J. (1995). Proc. IEEE 83, 802.

    Examples
    --------
    >>> phase = al.effects.FlickerPhase(F=1e-9)
    >>> print((phase.psd([0.02], rate=100) / phase.psd([0.01], rate=100)).round(3))
    [2.]
    """

    F: float | None = None

    kind = "flicker_phase"
    short = "F"
    catalog_place = 17
    title = "flicker phase noise"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "flicker PM"}
    family = "coefficient"
    screened = "none"
    coefficient = "F"
    parameters = (Parameter("F", 1.0, "root of the density of the phase at 2πf = 1/s"),)
    single = True
    physics = "1/f phase noise of amplifiers, dividers and cables behind an oscillator"
    looks_like = "a slope of −1 of the Allan deviation as of white PM, and of −1 of the modified one (white PM: −3/2)"
    check_by = "measure the same clock through another amplifier, or two outputs of one distribution against each other"
    rivals = ("quantization", "power_law")

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: a power law with exponent 1 and squared level `rate`²."""
        return (PowerLawTerm(1.0, rate**2),)

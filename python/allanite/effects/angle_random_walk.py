"""Angle random walk N: white rate noise (IEEE 952-1997 C.1.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter, StraightLine, texts_for_clocks
from allanite.effects.terms import Term, White


@dataclass(frozen=True)
class AngleRandomWalk(Stochastic):
    """S(f) = N² (two-sided); σ²(τ) = N²/τ. Slope −½. A data sheet's one-sided density is √2·N.

    References
    ----------
    IEEE 952-1997, C.1.1.

    Examples
    --------
    >>> noise = al.AngleRandomWalk(N=0.1)
    >>> print(noise.allan_variance([1.0, 100.0], rate=10).round(6), noise.psd(1.0, rate=10).round(6))
    [0.01   0.0001] 0.01
    """

    N: float | None = None

    kind = "angle_random_walk"
    short = "N"
    catalog_place = 2
    on_sheets = "N is two-sided, a data sheet's one-sided density is √2·N"
    common = True
    title = "angle random walk"
    titles: ClassVar[dict[str, str]] = {
        "acceleration": "velocity random walk",
        "fractional frequency": "white FM",
        "magnetic field": "white noise",
    }
    family = "coefficient"
    coefficient = "N"
    parameters = (
        Parameter(
            "N",
            0.5,
            "angle random walk coefficient: root of the two-sided white density",
            sheet={"angular rate": "deg/sqrt(h)", "acceleration": "m/s/sqrt(h)"},
            figures={
                "noise_density": ("noise",),
                "angle_random_walk": ("arw",),
                "velocity_random_walk": ("vrw",),
            },
        ),
    )
    single = True
    white = True
    standard = StraightLine("N", -0.5, 1.0, 1.0, "white")
    physics = "white rate noise: thermo-mechanical motion, shot noise of the light, amplifier noise"
    looks_like = "a slope of −½; a flat density"
    check_by = "compare with the data sheet's noise density (one-sided: √2·N); it should not depend on the sampling rate"
    texts = texts_for_clocks(
        physics="white frequency noise: shot and thermal noise of the resonator or of the loop locked to an atomic line",
        check_by="compare with the Allan deviation of the data sheet at 1 s; it should not depend on the sampling rate",
    )
    rivals = ("bias_instability", "power_law")

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: white noise with variance 1/τ0 = `rate` per sample."""
        return (White(rate),)

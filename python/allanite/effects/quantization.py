"""Quantization noise Q: the angle is counted in steps (IEEE 952-1997 C.1.2; 647-2006)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter, StraightLine, texts_for_clocks
from allanite.effects.terms import Blue, Term


@dataclass(frozen=True)
class Quantization(Stochastic):
    """S(f) = (4Q²/τ0) sin²(πfτ0); σ²(τ) = 3Q²/τ², exact at every m. Slope −1.

    References
    ----------
    IEEE 952-1997, C.1.2; IEEE 647-2006.

    Examples
    --------
    >>> print(np.sqrt(al.Quantization(Q=1e-4).allan_variance(2.0, rate=100)).round(7))  # √3 Q/τ
    8.66e-05
    """

    Q: float | None = None

    kind = "quantization"
    short = "Q"
    catalog_place = 1
    common = True
    title = "quantization noise"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "white PM"}
    family = "coefficient"
    coefficient = "Q"
    parameters = (
        Parameter(
            "Q",
            1.0,
            "quantization coefficient: step of the counted angle over √12",
            sheet={"angular rate": "deg", "acceleration": "m/s"},
            figures={"quantization": ("quantisation",)},
        ),
    )
    single = True
    standard = StraightLine("Q", -1.0, float(np.sqrt(3.0)), 1.0, "blue")
    physics = (
        "the sensor counts angle (velocity, phase) in steps S and outputs differences; "
        "the rounding error, Q = S/√12, is bounded and therefore averages out"
    )
    looks_like = "a slope of −1 at the shortest τ; a density that rises as f²"
    check_by = (
        "compare √12·Q with the sensor's pulse weight; check whether increments are whole multiples of a step; "
        "dither the input and repeat"
    )
    texts = texts_for_clocks(
        physics="white phase noise, which does not accumulate: resolution and noise of the counter or the time stamps",
        looks_like="a slope of −1 at the shortest τ (modified deviation: −3/2); a density that rises as f²",
        check_by="compare √12·Q with the resolution of the counter; measure the clock with another counter",
    )
    # Behind a low-pass filter, flicker fills the stop band, too.
    rivals = ("power_law", "bias_instability")

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: first differences of white angle errors of variance 1, divided by the sampling interval."""
        return (Blue(rate**2),)

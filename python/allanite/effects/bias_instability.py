"""Bias instability B: flicker (1/f) noise (IEEE 952-1997 C.1.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter, StraightLine, texts_for_clocks
from allanite.effects.terms import Flicker, Term


@dataclass(frozen=True)
class BiasInstability(Stochastic):
    """S(f) = B²τ0/(2 sin(πfτ0)) → B²/(2πf); plateau σ = √(2 ln2/π) B = 0.6643 B, 20 % above it at m = 1.

    References
    ----------
    IEEE 952-1997, C.1.3. Discrete form: Kasdin, N. J. (1995). Proc. IEEE 83, 802.

    Examples
    --------
    >>> floor = al.BiasInstability(B=1.0).allan_variance([100.0], rate=10)
    >>> print(np.sqrt(floor).round(3), np.round(np.sqrt(2 * np.log(2) / np.pi), 3))
    [0.664] 0.664
    """

    B: float | None = None

    kind = "bias_instability"
    short = "B"
    catalog_place = 3
    on_sheets = "B is the coefficient; a data sheet's bias instability is usually the minimum of the curve, 0.664·B or more"
    common = True
    title = "bias instability"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "flicker FM"}
    family = "coefficient"
    coefficient = "B"
    parameters = (
        Parameter(
            "B",
            0.0,
            "bias instability coefficient: Allan plateau over 0.6643",
            sheet={"angular rate": "deg/h", "acceleration": "ug"},
            figures={"bias_instability": ()},
        ),
    )
    single = True
    wanders = True
    standard = StraightLine("B", 0.0, None, float(np.sqrt(2.0 * np.log(2.0) / np.pi)), "flicker")
    physics = "1/f noise of the electronics and of the sensing material"
    looks_like = "a flat floor of the Allan deviation; a density that falls as 1/f"
    check_by = (
        "record longer: a true flicker floor stays flat over decades, a sum of lags does not; "
        "repeat at another supply current or modulation frequency"
    )
    texts = texts_for_clocks(
        physics="1/f noise of the electronics and of the resonator, which shifts the frequency",
        check_by="record longer: a true flicker floor stays flat over decades; compare the clock with another reference",
    )
    rivals = ("gauss_markov", "power_law", "rate_random_walk")

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: flicker noise with B = 1, a half-order fractional sum of white noise (Kasdin 1995)."""
        return (Flicker(1.0),)

"""Power-law noise with any exponent, if no other effect describes the spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._declared import Array, Parameter
from allanite.effects.terms import PowerLaw as PowerLawTerm
from allanite.effects.terms import Term


@dataclass(frozen=True)
class PowerLaw(Stochastic):
    """S(f) = L² (2πf)^a, by fractional differences; a = 2, 0, −1, −2 are Q, N, B, K with L that coefficient.

    References
    ----------
    Hosking, J. R. M. (1981). Fractional differencing. Biometrika 68, 165. Kasdin, N. J. (1995). Proc. IEEE 83, 802.

    Examples
    --------
    >>> flicker = al.effects.PowerLaw(exponent=-1.0, level=0.01)
    >>> print((flicker.psd([0.01], rate=100) / flicker.psd([0.1], rate=100)).round(1))
    [10.]
    """

    exponent: float | None = None
    level: float | None = None

    kind = "power_law"
    short = "PL"
    catalog_place = 18
    title = "power law"
    coefficient = "level"
    parameters = (
        Parameter(
            "exponent",
            "1",
            "exponent a of the density",
            "shape",
            low=-2.95,
            high=0.95,
            aliases=("a",),
            symbol="α",
        ),
        Parameter("level", "U·s^(½+a/2)", "root of the density at 2πf = 1/s"),
    )
    wanders = True
    last_resort = True
    legend = ("exponent",)
    physics = "scale-free noise without one time constant: a spread of traps or relaxations"
    looks_like = "a straight line of the density with a slope other than the standard ones"
    check_by = "record for longer: a true power law keeps its slope, a sum of lags bends; vary the temperature"
    rivals = ("bias_instability", "rate_random_walk", "gauss_markov")

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of ten exponents between the standard ones (−2, −1, 0) and beyond."""
        return np.array([-2.6, -2.3, -1.7, -1.4, -1.2, -0.8, -0.6, -0.4, 0.4, 0.7])

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: a power law with exponent a (−1 without a value) and squared level `rate`^{a+1}."""
        a = round(self.exponent if self.exponent is not None else -1.0, 6)
        return (PowerLawTerm(a, rate ** (a + 1.0)),)

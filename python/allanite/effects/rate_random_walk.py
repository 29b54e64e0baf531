"""Rate random walk K (IEEE 952-1997 C.1.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter, StraightLine
from allanite.effects.terms import RandomWalk, Term


@dataclass(frozen=True)
class RateRandomWalk(Stochastic):
    """S(f) = K²τ0²/(4 sin²(πfτ0)) → (K/2πf)²; σ²(m) = K²τ(2m²+1)/(6m²) → K²τ/3. Slope +½.

    References
    ----------
    IEEE 952-1997, C.1.4.

    Examples
    --------
    >>> print(np.sqrt(al.RateRandomWalk(K=1e-3).allan_variance(300.0, rate=100)).round(4))  # K √(τ/3)
    0.01
    """

    K: float | None = None

    kind = "rate_random_walk"
    short = "K"
    catalog_place = 4
    common = True
    title = "rate random walk"
    titles: ClassVar[dict[str, str]] = {
        "acceleration": "acceleration random walk",
        "fractional frequency": "random-walk FM",
        "magnetic field": "random walk",
    }
    family = "coefficient"
    coefficient = "K"
    parameters = (
        Parameter(
            "K",
            -0.5,
            "rate random walk coefficient",
            sheet={"angular rate": "deg/h/sqrt(h)", "acceleration": "m/s/h/sqrt(h)"},
            figures={"rate_random_walk": ("rrw",), "acceleration_random_walk": ()},
        ),
    )
    single = True
    wanders = True
    standard = StraightLine("K", 0.5, 3.0, 1.0, "random_walk")
    physics = "slow aging, or an unmodeled temperature, that wanders without a time constant"
    looks_like = "a slope of +½ at the longest τ; a density that falls as 1/f²"
    check_by = "log the temperature; record longer: a lag levels off, a random walk does not"
    rivals = ("gauss_markov", "rate_ramp", "power_law", "bias_instability", "warm_up", "covariate")

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: a random walk with steps of variance τ0 = 1/`rate` per sample."""
        return (RandomWalk(1.0 / rate),)

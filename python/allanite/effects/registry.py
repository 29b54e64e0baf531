"""The catalogue: a new effect is one file and one line here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects.angle_random_walk import AngleRandomWalk
from allanite.effects.bandwidth import Bandwidth
from allanite.effects.bias_instability import BiasInstability
from allanite.effects.bias_step import BiasStep
from allanite.effects.burst_noise import BurstNoise
from allanite.effects.covariate import Covariate
from allanite.effects.gauss_markov import GaussMarkov
from allanite.effects.noise_level_change import NoiseLevelChange
from allanite.effects.outliers import Outliers
from allanite.effects.power_law import PowerLaw
from allanite.effects.quantization import Quantization
from allanite.effects.rate_ramp import RateRamp
from allanite.effects.rate_random_walk import RateRandomWalk
from allanite.effects.resonance import Resonance
from allanite.effects.sinusoid import Sinusoid
from allanite.effects.warm_up import WarmUp

if TYPE_CHECKING:
    from allanite.effects._base import Effect

__all__ = ["CATALOGUE", "find"]

#: Every effect, in the order in which models are written.
CATALOGUE: tuple[type[Effect], ...] = (
    Quantization,
    AngleRandomWalk,
    BiasInstability,
    RateRandomWalk,
    RateRamp,
    GaussMarkov,
    Sinusoid,
    Bandwidth,
    Resonance,
    PowerLaw,
    Covariate,
    BiasStep,
    WarmUp,
    BurstNoise,
    NoiseLevelChange,
    Outliers,
)


def find(name: str) -> type[Effect] | None:
    """The effect of a short or long name, or None."""
    return next((e for e in CATALOGUE if name in (e.short, e.kind)), None)

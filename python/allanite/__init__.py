"""allanite: noise models of inertial sensors, compared with measurements until nothing is missing."""

from __future__ import annotations


from allanite._kernels import version as _version
from allanite.effects import CATALOGUE, Effect, Model, parse_model
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
from allanite.errors import AllaniteError, InputError, TooShortError
from allanite.fit import Fit, fit_model
from allanite.parameters import Estimate
from allanite.readers import read
from allanite.recording import Recording
from allanite.simulate import simulate
from allanite.spectrum import Spectrum, psd
from allanite.study import Study, improve
from allanite.suggestion import Check, Suggestion

__version__ = _version()

__all__ = [
    "CATALOGUE",
    "AllaniteError",
    "AngleRandomWalk",
    "Bandwidth",
    "BiasInstability",
    "BiasStep",
    "BurstNoise",
    "Check",
    "Covariate",
    "Effect",
    "Estimate",
    "Fit",
    "GaussMarkov",
    "InputError",
    "Model",
    "NoiseLevelChange",
    "Outliers",
    "PowerLaw",
    "Quantization",
    "RateRamp",
    "RateRandomWalk",
    "Recording",
    "Resonance",
    "Sinusoid",
    "Spectrum",
    "Study",
    "Suggestion",
    "TooShortError",
    "WarmUp",
    "__version__",
    "fit_model",
    "improve",
    "parse_model",
    "psd",
    "read",
    "simulate",
]

"""allanite: noise models of inertial sensors, criticised until nothing is missing."""

# Names are imported when first asked for: the command line must not pay for the fit to show
# its help. (`simulate` is a method of models; the name is that of a module.)

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite._kernels import release
    from allanite.axes import Characterization, characterize
    from allanite.common.errors import AllaniteError, InputError, TooShortError
    from allanite.common.parameters import Estimate
    from allanite.comparison import Acceptance, Curves, accept, compare
    from allanite.comparison.datasheet import (
        DataSheet,
        Quoted,
        compare_datasheet,
        read_datasheet,
    )
    from allanite.deviation import (
        Deviation,
        adev,
        hdev,
        htotdev,
        mdev,
        mtie,
        mtotdev,
        oadev,
        ohdev,
        pdev,
        tdev,
        tierms,
        totdev,
        ttotdev,
    )
    from allanite.deviation.accumulator import Accumulator
    from allanite.deviation.dynamic import DynamicDeviation, dynamic_oadev
    from allanite.deviation.theo import theo1, theoh
    from allanite.effects import CATALOGUE, Effect, Model, parse_model, register
    from allanite.effects.angle_random_walk import AngleRandomWalk
    from allanite.effects.band_level_change import BandLevelChange
    from allanite.effects.bandwidth import Bandwidth
    from allanite.effects.bias_instability import BiasInstability
    from allanite.effects.bias_step import BiasStep
    from allanite.effects.burst_noise import BurstNoise
    from allanite.effects.covariate import Covariate
    from allanite.effects.disturbance import Disturbance
    from allanite.effects.drifting_line import DriftingLine
    from allanite.effects.drifting_resonance import DriftingResonance
    from allanite.effects.excursion import Excursion
    from allanite.effects.excursions import Excursions
    from allanite.effects.gauss_markov import GaussMarkov
    from allanite.effects.high_pass import HighPass
    from allanite.effects.hysteresis import Hysteresis
    from allanite.effects.modulated_vibration import ModulatedVibration
    from allanite.effects.noise_level_change import NoiseLevelChange
    from allanite.effects.noise_levels import NoiseLevels
    from allanite.effects.noise_of_column import NoiseOfColumn
    from allanite.effects.notch import Notch
    from allanite.effects.outliers import Outliers
    from allanite.effects.periodic_noise_level import PeriodicNoiseLevel
    from allanite.effects.power_law import PowerLaw
    from allanite.effects.quantization import Quantization
    from allanite.effects.rate_of_change import RateOfChange
    from allanite.effects.rate_ramp import RateRamp
    from allanite.effects.rate_random_walk import RateRandomWalk
    from allanite.effects.resonance import Resonance
    from allanite.effects.sinusoid import Sinusoid
    from allanite.effects.tone_burst import ToneBurst
    from allanite.effects.transient import Transient
    from allanite.effects.two_lags import TwoLags
    from allanite.effects.unexplained import Unexplained
    from allanite.effects.warm_up import WarmUp
    from allanite.fit import Fit, fit_model
    from allanite.fit.several.many import ManyFits, fit_many
    from allanite.page import explore
    from allanite.planning import Plan, Power, plan, power
    from allanite.readers import read
    from allanite.readers.inspection import inspect
    from allanite.recording import Recording
    from allanite.report import Report, make_report
    from allanite.scale import Fleet, Watch, fleet
    from allanite.spectrum import Spectrum, psd
    from allanite.statespace import Innovations, StateSpace, innovations
    from allanite.statespace.growth import Growth, measured_growth, predict
    from allanite.study import Study, improve
    from allanite.suggestion import Check, Suggestion
    from allanite.summary import Summary, summarise

_HOME = {
    "Characterization": "allanite.axes",
    "characterize": "allanite.axes",
    "Deviation": "allanite.deviation",
    "adev": "allanite.deviation",
    "oadev": "allanite.deviation",
    "hdev": "allanite.deviation",
    "htotdev": "allanite.deviation",
    "mdev": "allanite.deviation",
    "mtie": "allanite.deviation",
    "mtotdev": "allanite.deviation",
    "ohdev": "allanite.deviation",
    "pdev": "allanite.deviation",
    "tdev": "allanite.deviation",
    "tierms": "allanite.deviation",
    "totdev": "allanite.deviation",
    "ttotdev": "allanite.deviation",
    "DynamicDeviation": "allanite.deviation",
    "dynamic_oadev": "allanite.deviation",
    "theo1": "allanite.deviation",
    "theoh": "allanite.deviation",
    "Accumulator": "allanite.deviation",
    "Acceptance": "allanite.comparison",
    "accept": "allanite.comparison",
    "compare": "allanite.comparison",
    "Curves": "allanite.comparison",
    "DataSheet": "allanite.comparison.datasheet",
    "Quoted": "allanite.comparison.datasheet",
    "compare_datasheet": "allanite.comparison.datasheet",
    "read_datasheet": "allanite.comparison.datasheet",
    "CATALOGUE": "allanite.effects",
    "Effect": "allanite.effects",
    "Model": "allanite.effects",
    "parse_model": "allanite.effects",
    "register": "allanite.effects",
    "AngleRandomWalk": "allanite.effects.angle_random_walk",
    "BandLevelChange": "allanite.effects.band_level_change",
    "Bandwidth": "allanite.effects.bandwidth",
    "BiasInstability": "allanite.effects.bias_instability",
    "BiasStep": "allanite.effects.bias_step",
    "BurstNoise": "allanite.effects.burst_noise",
    "Covariate": "allanite.effects.covariate",
    "Disturbance": "allanite.effects.disturbance",
    "DriftingLine": "allanite.effects.drifting_line",
    "DriftingResonance": "allanite.effects.drifting_resonance",
    "Excursion": "allanite.effects.excursion",
    "Excursions": "allanite.effects.excursions",
    "HighPass": "allanite.effects.high_pass",
    "Hysteresis": "allanite.effects.hysteresis",
    "GaussMarkov": "allanite.effects.gauss_markov",
    "ModulatedVibration": "allanite.effects.modulated_vibration",
    "NoiseLevelChange": "allanite.effects.noise_level_change",
    "NoiseLevels": "allanite.effects.noise_levels",
    "NoiseOfColumn": "allanite.effects.noise_of_column",
    "Notch": "allanite.effects.notch",
    "Outliers": "allanite.effects.outliers",
    "PeriodicNoiseLevel": "allanite.effects.periodic_noise_level",
    "PowerLaw": "allanite.effects.power_law",
    "Quantization": "allanite.effects.quantization",
    "RateOfChange": "allanite.effects.rate_of_change",
    "RateRamp": "allanite.effects.rate_ramp",
    "RateRandomWalk": "allanite.effects.rate_random_walk",
    "Resonance": "allanite.effects.resonance",
    "Sinusoid": "allanite.effects.sinusoid",
    "ToneBurst": "allanite.effects.tone_burst",
    "Transient": "allanite.effects.transient",
    "TwoLags": "allanite.effects.two_lags",
    "Unexplained": "allanite.effects.unexplained",
    "WarmUp": "allanite.effects.warm_up",
    "AllaniteError": "allanite.common.errors",
    "InputError": "allanite.common.errors",
    "TooShortError": "allanite.common.errors",
    "Fit": "allanite.fit",
    "fit_model": "allanite.fit",
    "ManyFits": "allanite.fit.several.many",
    "fit_many": "allanite.fit.several.many",
    "explore": "allanite.page",
    "Estimate": "allanite.common.parameters",
    "Plan": "allanite.planning",
    "Power": "allanite.planning",
    "plan": "allanite.planning",
    "power": "allanite.planning",
    "inspect": "allanite.readers.inspection",
    "read": "allanite.readers",
    "Recording": "allanite.recording",
    "Report": "allanite.report",
    "make_report": "allanite.report",
    "Spectrum": "allanite.spectrum",
    "psd": "allanite.spectrum",
    "Innovations": "allanite.statespace",
    "StateSpace": "allanite.statespace",
    "innovations": "allanite.statespace",
    "Growth": "allanite.statespace.growth",
    "measured_growth": "allanite.statespace.growth",
    "predict": "allanite.statespace.growth",
    "Study": "allanite.study",
    "improve": "allanite.study",
    "Check": "allanite.suggestion",
    "Suggestion": "allanite.suggestion",
    "Summary": "allanite.summary",
    "summarise": "allanite.summary",
    "release": "allanite._kernels",
    "Fleet": "allanite.scale",
    "Watch": "allanite.scale",
    "fleet": "allanite.scale",
}

__all__ = [
    "CATALOGUE",
    "Acceptance",
    "Accumulator",
    "AllaniteError",
    "AngleRandomWalk",
    "BandLevelChange",
    "Bandwidth",
    "BiasInstability",
    "BiasStep",
    "BurstNoise",
    "Characterization",
    "Check",
    "Covariate",
    "Curves",
    "DataSheet",
    "Deviation",
    "Disturbance",
    "DriftingLine",
    "DriftingResonance",
    "DynamicDeviation",
    "Effect",
    "Estimate",
    "Excursion",
    "Excursions",
    "Fit",
    "Fleet",
    "GaussMarkov",
    "Growth",
    "HighPass",
    "Hysteresis",
    "Innovations",
    "InputError",
    "ManyFits",
    "Model",
    "ModulatedVibration",
    "NoiseLevelChange",
    "NoiseLevels",
    "NoiseOfColumn",
    "Notch",
    "Outliers",
    "PeriodicNoiseLevel",
    "Plan",
    "Power",
    "PowerLaw",
    "Quantization",
    "Quoted",
    "RateOfChange",
    "RateRamp",
    "RateRandomWalk",
    "Recording",
    "Report",
    "Resonance",
    "Sinusoid",
    "Spectrum",
    "StateSpace",
    "Study",
    "Suggestion",
    "Summary",
    "ToneBurst",
    "TooShortError",
    "Transient",
    "TwoLags",
    "Unexplained",
    "WarmUp",
    "Watch",
    "__version__",
    "accept",
    "adev",
    "characterize",
    "compare",
    "compare_datasheet",
    "dynamic_oadev",
    "explore",
    "fit_many",
    "fit_model",
    "fleet",
    "hdev",
    "htotdev",
    "improve",
    "innovations",
    "inspect",
    "make_report",
    "mdev",
    "measured_growth",
    "mtie",
    "mtotdev",
    "oadev",
    "ohdev",
    "parse_model",
    "pdev",
    "plan",
    "power",
    "predict",
    "psd",
    "read",
    "read_datasheet",
    "register",
    "release",
    "summarise",
    "tdev",
    "theo1",
    "theoh",
    "tierms",
    "totdev",
    "ttotdev",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from allanite._kernels import version

        value: object = version()
    elif name == "scale":
        value = import_module("allanite.scale")
    elif name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module 'allanite' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__

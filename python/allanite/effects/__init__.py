"""Catalog of physical effects, one file each, and their sums (models).

Input: parameter values or a model string (`parse_model`). Output: effects and a `Model` with spectrum, Allan variance
and known functions of time. Add an effect as one file here; effects are found by themselves.
`docs/make_lists.py` adds the name of a new effect for type checkers.
"""

from typing import TYPE_CHECKING

from allanite.common.extensions import modules_of
from allanite.common.former import warn_of_former_name
from allanite.effects._base import Effect as Effect
from allanite.effects._base import Parameter as Parameter
from allanite.effects._base import Stochastic as Stochastic
from allanite.effects._base import StraightLine as StraightLine
from allanite.effects._declared import SEARCH_METHODS as SEARCH_METHODS
from allanite.effects._declared import Columns as Columns
from allanite.effects._event import Away as Away
from allanite.effects._filter import Filter as Filter
from allanite.effects._filter import Response as Response
from allanite.effects._follower import Follower as Follower
from allanite.effects._follower import LaggedColumn as LaggedColumn
from allanite.effects._follower import followed_column as followed_column
from allanite.effects._follower import lagged as lagged
from allanite.effects._follower import weighted_sum as weighted_sum
from allanite.effects._known import Deterministic as Deterministic
from allanite.effects._known import Periodic as Periodic
from allanite.effects._level import Level as Level
from allanite.effects._limits import LIMIT_TOLERANCE as LIMIT_TOLERANCE
from allanite.effects._limits import Limits as Limits
from allanite.effects._limits import limitable as limitable
from allanite.effects._modifier import Modifier as Modifier
from allanite.effects._moving import Moving as Moving
from allanite.effects._moving import segment_weights as segment_weights
from allanite.effects.files import as_model as as_model
from allanite.effects.files import as_noise_model as as_noise_model
from allanite.effects.files import model_from_dict as model_from_dict
from allanite.effects.files import model_to_dict as model_to_dict
from allanite.effects.files import parse_model as parse_model
from allanite.effects.model import Model as Model
from allanite.effects.registry import CATALOG as CATALOG
from allanite.effects.registry import effects_in
from allanite.effects.registry import find as find
from allanite.effects.registry import register as register
from allanite.effects.registry import single_line as single_line
from allanite.effects.registry import standard as standard
from allanite.effects.registry import title_of as title_of
from allanite.effects.registry import white_noise as white_noise

if TYPE_CHECKING:  # written by docs/make_lists.py
    from allanite.effects.angle_random_walk import AngleRandomWalk as AngleRandomWalk
    from allanite.effects.band_level_change import BandLevelChange as BandLevelChange
    from allanite.effects.bandwidth import Bandwidth as Bandwidth
    from allanite.effects.bias_instability import BiasInstability as BiasInstability
    from allanite.effects.bias_step import BiasStep as BiasStep
    from allanite.effects.burst_noise import BurstNoise as BurstNoise
    from allanite.effects.covariate import Covariate as Covariate
    from allanite.effects.disturbance import Disturbance as Disturbance
    from allanite.effects.drifting_line import DriftingLine as DriftingLine
    from allanite.effects.drifting_resonance import DriftingResonance as DriftingResonance
    from allanite.effects.excursion import Excursion as Excursion
    from allanite.effects.excursions import Excursions as Excursions
    from allanite.effects.flicker_phase import FlickerPhase as FlickerPhase
    from allanite.effects.gauss_markov import GaussMarkov as GaussMarkov
    from allanite.effects.high_pass import HighPass as HighPass
    from allanite.effects.hump import Hump as Hump
    from allanite.effects.hysteresis import Hysteresis as Hysteresis
    from allanite.effects.modulated_vibration import ModulatedVibration as ModulatedVibration
    from allanite.effects.noise_level_change import NoiseLevelChange as NoiseLevelChange
    from allanite.effects.noise_levels import NoiseLevels as NoiseLevels
    from allanite.effects.noise_of_column import NoiseOfColumn as NoiseOfColumn
    from allanite.effects.notch import Notch as Notch
    from allanite.effects.outliers import Outliers as Outliers
    from allanite.effects.periodic_noise_level import PeriodicNoiseLevel as PeriodicNoiseLevel
    from allanite.effects.power_law import PowerLaw as PowerLaw
    from allanite.effects.quantization import Quantization as Quantization
    from allanite.effects.rate_of_change import RateOfChange as RateOfChange
    from allanite.effects.rate_ramp import RateRamp as RateRamp
    from allanite.effects.rate_random_walk import RateRandomWalk as RateRandomWalk
    from allanite.effects.resonance import Resonance as Resonance
    from allanite.effects.sinusoid import Sinusoid as Sinusoid
    from allanite.effects.tone_burst import ToneBurst as ToneBurst
    from allanite.effects.transient import Transient as Transient
    from allanite.effects.transition import Transition as Transition
    from allanite.effects.two_lags import TwoLags as TwoLags
    from allanite.effects.unexplained import Unexplained as Unexplained
    from allanite.effects.wandering_line import WanderingLine as WanderingLine
    from allanite.effects.warm_up import WarmUp as WarmUp

CATALOG.begin(*effects_in(modules_of(__name__)))
globals().update({effect.__name__: effect for effect in CATALOG.built_in})


def __getattr__(name: str) -> object:
    """Catalog `CATALOG` for its former name ``CATALOGUE``, with a `DeprecationWarning`; else `AttributeError`."""
    if name == "CATALOGUE":
        warn_of_former_name("al.effects.CATALOGUE", "al.effects.CATALOG")
        return CATALOG
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

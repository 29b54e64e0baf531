"""Public names and where each is defined; `__init__.py` imports a name when it is first used.

Former names stand at the end; their use warns. So does that of an effect that is now in `allanite.effects` alone.
"""

from allanite import comparison as comparison
from allanite import effects as effects
from allanite import plots as plots
from allanite import report as report
from allanite import scale as scale
from allanite import simulate as simulate
from allanite import statespace as statespace
from allanite import suggestion as suggestion
from allanite._kernels import free_buffers as free_buffers
from allanite.axes import Characterization as Characterization
from allanite.axes import characterize as characterize
from allanite.calibration import ThermalCalibration as ThermalCalibration
from allanite.calibration import thermal as thermal
from allanite.clocks import ClockDeviation as ClockDeviation
from allanite.clocks import Clocks as Clocks
from allanite.clocks import Timing as Timing
from allanite.clocks import Timings as Timings
from allanite.clocks import three_cornered_hat as three_cornered_hat
from allanite.clocks import timing as timing
from allanite.clocks import timing_columns as timing_columns
from allanite.combination import Combination as Combination
from allanite.combination import combine as combine
from allanite.common.errors import AllaniteError as AllaniteError
from allanite.common.errors import InputError as InputError
from allanite.common.errors import TooShortError as TooShortError
from allanite.common.parameters import Estimate as Estimate
from allanite.comparison import Acceptance as Acceptance
from allanite.comparison import Curves as Curves
from allanite.comparison import accept as accept
from allanite.comparison import compare as compare
from allanite.comparison.datasheet import compare_datasheet as compare_datasheet
from allanite.deviation import Deviation as Deviation
from allanite.deviation import Deviations as Deviations
from allanite.deviation import adev as adev
from allanite.deviation import deviations as deviations
from allanite.deviation import hdev as hdev
from allanite.deviation import htotdev as htotdev
from allanite.deviation import mdev as mdev
from allanite.deviation import mtie as mtie
from allanite.deviation import mtotdev as mtotdev
from allanite.deviation import oadev as oadev
from allanite.deviation import ohdev as ohdev
from allanite.deviation import pdev as pdev
from allanite.deviation import tdev as tdev
from allanite.deviation import tierms as tierms
from allanite.deviation import totdev as totdev
from allanite.deviation import ttotdev as ttotdev
from allanite.deviation.accumulator import Accumulator as Accumulator
from allanite.deviation.dynamic import DynamicDeviation as DynamicDeviation
from allanite.deviation.dynamic import dynamic_oadev as dynamic_oadev
from allanite.deviation.theo import theo1 as theo1
from allanite.deviation.theo import theoh as theoh
from allanite.effects import CATALOG as CATALOG
from allanite.effects import AngleRandomWalk as AngleRandomWalk
from allanite.effects import BiasInstability as BiasInstability
from allanite.effects import Effect as Effect
from allanite.effects import GaussMarkov as GaussMarkov
from allanite.effects import Model as Model
from allanite.effects import Quantization as Quantization
from allanite.effects import RateRamp as RateRamp
from allanite.effects import RateRandomWalk as RateRandomWalk
from allanite.effects import Sinusoid as Sinusoid
from allanite.effects import parse_model as parse_model
from allanite.effects import register as register
from allanite.exports import export as export
from allanite.fit import Fit as Fit
from allanite.fit import fit_columns as fit_columns
from allanite.fit import fit_many as fit_many
from allanite.fit import fit_model as fit_model
from allanite.fit.several import Fits as Fits
from allanite.fit.several import ManyFits as ManyFits
from allanite.page import explore as explore
from allanite.planning import Plan as Plan
from allanite.planning import Power as Power
from allanite.planning import detection_power as detection_power
from allanite.planning import plan as plan
from allanite.readers import read as read
from allanite.readers.inspection import inspect as inspect
from allanite.recording import Recording as Recording
from allanite.report import Report as Report
from allanite.report import make_report as make_report
from allanite.scale import Fleet as Fleet
from allanite.scale import Watch as Watch
from allanite.scale import fleet as fleet
from allanite.sources.datasheet import DataSheet as DataSheet
from allanite.sources.datasheet import Quoted as Quoted
from allanite.sources.datasheet import read_datasheet as read_datasheet
from allanite.spectrum import Spectrum as Spectrum
from allanite.spectrum import psd as psd
from allanite.statespace import Innovations as Innovations
from allanite.statespace import StateSpace as StateSpace
from allanite.statespace import innovations as innovations
from allanite.statespace.growth import Growth as Growth
from allanite.statespace.growth import error_growth as error_growth
from allanite.statespace.growth import measured_growth as measured_growth
from allanite.study import Study as Study
from allanite.study import improve as improve
from allanite.study import improve_columns as improve_columns
from allanite.suggestion import Check as Check
from allanite.suggestion import Suggestion as Suggestion
from allanite.summary import Summary as Summary
from allanite.summary import summarize as summarize
from allanite.trends import Trend as Trend
from allanite.trends import Trends as Trends
from allanite.trends import trend as trend
from allanite.trends import trend_columns as trend_columns

__version__: str

CATALOGUE = CATALOG
power = detection_power
predict = error_growth
release = free_buffers
summarise = summarize

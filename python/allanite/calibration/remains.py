"""Results after a thermal fit: hysteresis, noise over temperature, offsets of runs, Allan deviation and error growth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.calibration.forms import Form, law_of
from allanite.calibration.law import Loop, NoiseLaw, Remainder
from allanite.common.parameters import NORMAL
from allanite.common.units import parse_unit
from allanite.deviation import oadev
from allanite.fit.likelihood.whitened import cell_means, whiten
from allanite.fit.shapes.deterministic import LOWEST_ORDINATES, design_of, regress
from allanite.statespace.growth import QUANTITIES, error_growth
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY
from allanite.suggestion.screens.level_changes import level_series
from allanite.suggestion.screens.level_forms import PERIOD_CELLS, log_slope

if TYPE_CHECKING:
    from allanite.calibration.runs import Runs
    from allanite.common.arrays import Array
    from allanite.fit import Fit
    from allanite.statespace.growth import Growth

#: A run is used up to the averaging time that fits into the run this many times. Beyond, the deviation is too uncertain.
MIN_AVERAGES = 4
#: Times after the last fix for which the error is stated, s; times longer than the longest run are omitted.
TIMES_AFTER_FIX = (60.0, 600.0, 3600.0)
#: Duration of aiding before the last fix, s.
AIDING_DURATION = 60.0
#: Maximum number of samples over which the growth of an error is computed; limits time and memory.
MAX_SAMPLES = 1 << 20


def loop_of(fit: Fit, runs: Runs, form: Form) -> Loop | None:
    """`Loop`: mean bias while cooling minus mean bias while warming, with 95 % interval and temperature range.

    None if no temperature was passed both while warming and while cooling. The difference is fitted by weighted least
    squares, together with the offset of each log and a polynomial in T without lag and hysteresis.
    """
    both = runs.both_ways
    if both is None:
        return None
    data = fit.data
    j = np.arange(1, min(data.n, LOWEST_ORDINATES), dtype=np.int64)
    direction = data.attenuated(data.transform(runs.direction)[j], j)
    law_columns = design_of(Form(max(form.power, 1)).effects(runs), data, j).matrix
    variance = fit.solution.noise(data).variance(j)
    found = regress(np.column_stack([direction, law_columns]), data.ordinates[j], variance)
    value, error = float(found.amplitudes[0]), float(np.sqrt(found.covariance[0, 0]))
    return Loop(value, (value - NORMAL * error, value + NORMAL * error), *both)


def noise_law(fit: Fit, runs: Runs) -> NoiseLaw | None:
    """`NoiseLaw`; None if the level cannot be followed over time, or if the temperature is constant."""
    from scipy.special import log_ndtr

    series = level_series(fit.solution, fit.data, whiten(fit.solution, fit.data))
    if series is None:
        return None
    cells = min(PERIOD_CELLS, series.judged.size)
    freedom = series.freedom * series.judged.size / cells
    values = cell_means(runs.temperature, cells)
    spread = float(values.std())
    if spread <= 0.0:
        return None
    values = (values - values.mean()) / spread
    # Normal scores are used for the test only, because they would make the estimated slope too small.
    slope, _ = log_slope(cell_means(series.power, cells), values, freedom)
    _, gain = log_slope(cell_means(series.judged, cells), values, freedom)
    # Half of the slope of power is that of the standard deviation. Other noise in the bands reduces it by `share`.
    scale = 100.0 * 0.5 / spread / series.share
    error = float(np.sqrt(2.0 / (freedom * cells)))
    chance = float(log_ndtr(-np.sqrt(2.0 * max(gain, 0.0))) + np.log(2.0))
    interval = scale * (slope - NORMAL * error), scale * (slope + NORMAL * error)
    return NoiseLaw(scale * slope, interval, chance < float(np.log(FALSE_ALARM_PROBABILITY)))


def law_signal(fit: Fit) -> Array:
    """Contribution of the thermal law to each sample, in the unit of the samples, shape (n,).

    For a law without a lag, its mean over the record is zero.
    """
    effects = law_of(fit)
    return fit.data.signal(effects) if effects else np.zeros(fit.data.n)


def walk_of_steps(fit: Fit, runs: Runs) -> float:
    """Largest coefficient K, in the unit of the samples per √s, that the rounding of the temperature can cause, or 0.

    A coarse thermometer logs the temperature in steps. The law b(T) turns this rounding error into a bias error, whose
    spectrum is compared with that of a random walk.
    """
    lines = ((p, p.effect.standard) for p in fit.solution.processes)
    walk = next((p for p, line in lines if line is not None and line.name == "K"), None)
    if walk is None or runs.step == 0.0 or not law_of(fit):
        return 0.0
    data, spectrum = fit.data, fit.solution.spectrum
    logged = {runs.column: runs.temperature + runs.rounding}
    effects = law_of(fit)
    made = sum(e.signal(data.time, logged) for e in effects) - data.signal(effects)
    power = data.bins.power(data.transform(made))
    weight = fit.solution.count * walk.column / spectrum**2
    return float(np.sqrt(max(float(weight @ power / (weight @ walk.column)), 0.0)))


def offsets_of(fit: Fit, runs: Runs) -> tuple[float, ...]:
    """Bias of each log (unit of the samples) at the reference temperature, the mean temperature."""
    left = np.asarray(runs.recording.samples, dtype=float) - law_signal(fit)
    # The quadratic and cubic terms were fitted without their means, so that the means are subtracted here.
    mean = 0.0
    for effect in law_of(fit):
        u = effect.regressors(fit.data.time, fit.data.covariates)[:, 0]
        terms = zip(effect.amplitudes(), effect.column_powers, strict=False)
        mean += sum(float(c) * float(np.mean(u**power)) for c, power in terms if power > 1)
    return tuple(float(np.nanmean(left[part])) - mean for part in runs.parts)


def deviations_before_and_after(fit: Fit, runs: Runs) -> Remainder:
    """`Remainder`: Allan deviation of the samples before and after correction, at common averaging times.

    Each log is evaluated separately. The variances of the logs are averaged, weighted by their numbers of squared
    differences. Averaging times with fewer than four averages in every log, or without a value, are omitted.
    """
    x = np.asarray(runs.recording.samples, dtype=float)
    left = x - law_signal(fit)
    longest = max(part.stop - part.start for part in runs.parts)
    most = max(longest // MIN_AVERAGES, 1)
    factors = np.unique(np.round(2.0 ** np.arange(0.0, np.log2(most) + 1e-9, 0.5)).astype(int))
    curves = []
    for values in (x, left):
        total, weight = np.zeros(factors.size), np.zeros(factors.size)
        for part in runs.parts:
            usable = factors <= (part.stop - part.start) // MIN_AVERAGES
            if not usable.any():
                continue
            found = oadev(values[part], rate=runs.recording.rate, factors=factors[usable])
            n = found.n * np.isfinite(found.deviation)
            total[usable] += n * np.nan_to_num(found.deviation) ** 2
            weight[usable] += n
        curves.append(np.sqrt(total / np.where(weight > 0.0, weight, np.nan)))
    tau = factors / runs.recording.rate
    good = np.isfinite(curves[0]) & (curves[0] > 0.0) & (curves[1] > 0.0)
    return Remainder(tau[good], curves[0][good], curves[1][good])


def error_growths(fit: Fit, runs: Runs) -> tuple[Growth, ...]:
    """Standard deviation of the integrated sensor error 1 min, 10 min and 1 h after the last fix, due to noise.

    Before the fix, the sensor is aided for 1 min. Times are left out if they exceed the longest log, are below one
    sample, or make more than 2²⁰ samples with the aiding. Empty if no time is left, or for another kind of sensor.
    """
    if parse_unit(fit.recording.unit).kind not in QUANTITIES:
        return ()
    longest = max(part.stop - part.start for part in runs.parts) / fit.recording.rate
    rate = fit.recording.rate
    times = [
        t
        for t in TIMES_AFTER_FIX
        if t <= longest and (t + AIDING_DURATION) * rate <= MAX_SAMPLES and t * rate >= 1.0
    ]
    if not times:
        return ()
    return error_growth(fit, aided=max(AIDING_DURATION, 1.0 / rate), tau=times)[:1]

"""Standard errors, 95 % intervals and limits of fitted values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.parameters import NORMAL, Estimate
from allanite.common.printing import column_unit
from allanite.common.units import coefficient_unit
from allanite.effects import Deterministic, Effect, Model, Parameter
from allanite.fit.covariance import joint_covariance, logl_scale, shape_widening
from allanite.fit.likelihood.heavy import widened_by_tails
from allanite.fit.likelihood.peaks import is_fitted_to_ordinates
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.whittle import Maximum, loss_at_zero, profile_interval
from allanite.fit.marginal import Mixture, slow_amplitudes, slow_values
from allanite.fit.shapes.deterministic import design_of, shape_slope
from allanite.fit.shapes.matched import FILTER_ORDINATES, matched_gains
from allanite.fit.shapes.narrow import ordinates_delta_logl
from allanite.fit.solution import Process, Regressed, Solution

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.recording import Recording
    from allanite.summary import Summary

#: Number of trial times on each side of the time of an edge, at distances from one sample to the duration of the record. As
#: many again are spread evenly over each half of the record. Basis: half and twice as many change the median error by at
#: most 4 % (benches/decisions/chosen_values.py edges).
EDGE_TIMES = 64
#: Significance level of detections. Chosen by judgment; the usual 1 %.
DETECTION_P = 0.01
#: Minimum loss of logL without a non-negative coefficient for it to be detected: 1 % point of ½χ²₀ + ½χ²₁, halved, which is
#: ½z² with the 99 % point z of the normal distribution.
MIN_COEFFICIENT_DELTA_LOGL = 0.5 * 2.326348**2
#: Minimum loss of logL without an effect with its own shape or phase: 1 % point of χ²₂, halved, which is −ln 0.01.
MIN_SHAPED_DELTA_LOGL = float(-np.log(DETECTION_P))
#: Minimum loss of logL without an amplitude of either sign: 1 % point of χ²₁, halved, which is ½z² with the 99.5 % point z.
MIN_SIGNED_DELTA_LOGL = 0.5 * 2.575829**2
#: A shape is at the lower end of its search range if it is at most this factor above the end. Chosen by judgment; not
#: measured.
MAX_RATIO_TO_SEARCH_END = 1.001
#: Maximum half-width of an interval in ln; it stands for a value that is not known at all. Chosen by judgment; not
#: measured.
MAX_LOG_HALF_WIDTH = 50.0
#: Minimum part of an event that lies in a gap if the record does not show its times. Chosen by judgment; not measured.
MIN_HIDDEN_FRACTION = 0.9

#: Standard error of a value, None if unknown, and its 95 % interval.
Range = tuple[float | None, tuple[float, float]]
#: Distributions of the amplitudes of slow functions with shapes as fitted, from `slow_amplitudes`.
Laws = Mapping[Regressed, Mixture]
#: Ranges of the values of an effect by parameter name.
Ranges = dict[str, Range]


def min_detected_delta_logl(effect: Effect, amplitudes: int = 1) -> float:
    """Rise of logL, nats, that an effect with this number of `amplitudes` must bring to a fit to count as detected."""
    if amplitudes > 1 or effect.free_shapes:
        return MIN_SHAPED_DELTA_LOGL
    signed = isinstance(effect, Deterministic)
    return MIN_SIGNED_DELTA_LOGL if signed else MIN_COEFFICIENT_DELTA_LOGL


def parameter_unit(
    effect: Effect, name: str, sample_unit: str, column_units: Mapping[str, str] | None = None
) -> str:
    """Unit (text) of the parameter `name` of an effect, for samples and a logged column in the given units.

    In a declared unit, ``U`` stands for the unit of the samples and ``unit`` for that of the column.
    """
    declared = effect.parameter(name).unit
    if not isinstance(declared, str):
        return coefficient_unit(sample_unit, declared)
    if "unit" in declared:
        explains = str(effect.follows)
        per = column_unit(explains, (column_units or {}).get(explains))
        declared = declared.replace("unit", per)
    return sample_unit + declared[1:] if declared.startswith("U") else declared


def estimates(
    solution: Solution,
    data: Data,
    recording: Recording | Summary,
    places: Sequence[int] | None = None,
) -> tuple[dict[str, Any], ...]:
    """Tuple of a dict for each effect of the model: values by parameter name, numbers as `Estimate` with interval.

    `recording` gives the units of the samples and of the logged columns. With `places`, only the effects at these indices
    are estimated. Texts, tuples and None are returned unchanged.
    """
    names, covariance = joint_covariance(solution, data)
    joint: dict[int, dict[str, float]] = {}
    for (place, name), error in zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True):
        joint.setdefault(place, {})[name] = error
    places = range(len(solution.effects)) if places is None else places
    wanted = [solution.effects[place] for place in places]
    slow: dict[Regressed, tuple[Mixture, list[str]]] = {}
    laws: Laws = {}
    known = (own.effect for own in wanted if isinstance(own, Regressed))
    if any(e.low and not set(_amplitude_names(e)) <= set(e.held) for e in known):
        slow, laws = slow_values(solution, data), slow_amplitudes(solution, data)
    out = []
    for place, own in zip(places, wanted, strict=True):
        errors, detected = joint.get(place, {}), True
        if isinstance(own, Process):
            detected, ranges = _process_ranges(solution, own, errors, data)
        elif isinstance(own, Regressed):
            detected = _is_function_detected(own, laws.get(own))
            ranges = _function_ranges(solution, own, data)
            if own in slow:
                ranges |= with_noise_uncertainty(own.effect, ranges, *slow[own])
                if detected and own.amplitudes.size == 1:
                    ranges |= _without_0(own.effect, ranges, laws[own])
            ranges |= _ranges_over_gaps(own.effect, ranges, data)
        else:
            ranges = _modifier_ranges(own.effect, errors, data)
        units = {
            p.name: parameter_unit(own.effect, p.name, recording.unit, recording.covariate_units)
            for p in own.effect.parameters
        }
        out.append(_estimates_of(own.effect, detected, ranges, units))
    return tuple(out)


def _estimates_of(
    effect: Effect, detected: bool, ranges: Ranges, units: Mapping[str, str]
) -> dict[str, Any]:
    """Dict of the values of an effect by parameter name: numbers as `Estimate`, other values unchanged.

    Held values count as detected, and have no standard error and no interval. If the effect is not `detected`, its shapes,
    times and all values in Hz, s or rad have none either: the frequency of a line that does not exist has no true value.
    Its coefficients have intervals that include 0. Last, intervals are clipped to the limits that the user gave.
    """
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        name, value = parameter.name, effect.values[parameter.name]
        if not _is_number(value):
            out[name] = value
            continue
        is_held = name in effect.held
        is_shape = parameter.role in ("shape", "time") or parameter.unit in ("Hz", "s", "rad")
        error, interval = ranges.get(name) or (None, None)
        if is_held or (is_shape and not detected):
            error, interval = None, None
        elif interval is not None:
            if not detected and parameter.role == "coefficient":
                interval = min(interval[0], 0.0), max(interval[1], 0.0)
            low, high = (effect.checked_limits.clipped(name, end) for end in interval)
            interval = low, high
        out[name] = Estimate(value, error, interval, units[name], detected or is_held, name)
    return out


def with_noise_uncertainty(
    effect: Deterministic, ranges: Ranges, law: Mixture, shapes: Sequence[str] = ()
) -> Ranges:
    """Dict of the ranges of the amplitudes and `shapes` of a slow effect that include the uncertainty of the noise.

    `law` is the distribution of the amplitudes, then of the changes of the shapes from their fitted values, averaged over
    the noise coefficients. Values without an interval are omitted. An interval that misses the fitted value is joined with
    that for the fitted noise.
    """
    out: Ranges = {}
    for place, name in enumerate((*_amplitude_names(effect), *shapes)):
        if name in ranges and name in shapes:
            out[name] = _range(
                effect.parameter(name), effect.values[name], law.standard_error(place)
            )
        elif name in ranges:
            own, interval = ranges[name][1], law.interval(place)
            if not interval[0] <= effect.values[name] <= interval[1]:
                # Under equally likely noise another value is best; the interval includes both values.
                interval = min(interval[0], own[0]), max(interval[1], own[1])
            out[name] = law.standard_error(place), interval
    return out


def _without_0(effect: Deterministic, ranges: Ranges, law: Mixture) -> Ranges:
    """Dict of the range of the single amplitude of a detected slow effect, which does not include 0; empty without one.

    If it includes 0, the end beyond 0 becomes that of `law`, the distribution with the shapes as fitted. The other end
    stays: poorly known shapes leave open how large the amplitude is, but not whether it exists.
    """
    name = _amplitude_names(effect)[0]
    if name not in ranges or not _includes_0(ranges[name][1]):
        return {}
    error, (low, high) = ranges[name]
    least, most = law.interval(0)
    return {name: (error, (least, max(high, most)) if least > 0.0 else (min(low, least), most))}


def _amplitude_names(effect: Deterministic) -> list[str]:
    """List of the names of the coefficients of a deterministic effect that are not None."""
    return [
        p.name
        for p in effect.parameters
        if p.role == "coefficient" and effect.values[p.name] is not None
    ]


def _process_ranges(
    solution: Solution, own: Process, errors: dict[str, float], data: Data
) -> tuple[bool, Ranges]:
    """Pair (detected, ranges) of a random process. Derived parameters get the interval of the coefficient, scaled.

    `errors` are the standard errors of its parameters by `joint_covariance`.
    """
    effect, name = own.effect, own.effect.coefficient
    ranges = _shape_ranges(effect, errors)
    for shape in ranges:
        ranges[shape] = _extended_to_lowest(effect, shape, ranges[shape], data)
    if name in effect.held:
        return True, ranges
    value, relative = float(np.sqrt(own.theta)), errors.get(name)
    detected, ends = _coefficient_interval(solution, own, relative, data)
    ranges[name] = None if relative is None else value * relative, ends
    for parameter in effect.parameters if value else ():
        derived = effect.values[parameter.name]
        if parameter.role == "derived" and _is_number(derived):
            ranges[parameter.name] = None, (derived * ends[0] / value, derived * ends[1] / value)
    return detected, ranges


def _coefficient_interval(
    solution: Solution, own: Process, relative: float | None, data: Data
) -> tuple[bool, tuple[float, float]]:
    """Pair (detected, interval) of the coefficient of a process; `relative` is the standard error of its logarithm.

    If a coefficient is not detected, its interval starts at 0. The interval is wider for fitted shapes, and for white noise
    with heavy tails.
    """
    effect, value = own.effect, float(np.sqrt(own.theta))
    profile, scale = _profile(solution, own, data), logl_scale(solution, own, data)
    low, high, drop = profile_interval(*profile, scale)
    low, high = float(np.sqrt(low)), float(np.sqrt(high))
    drop += _loss_of_ordinates(solution, own, data)
    detected = drop > min_detected_delta_logl(effect)
    if not detected:
        low = 0.0
    elif relative is not None and not low:
        low, high = _log_interval(value, relative)
    elif relative is not None:
        # The profile interval is for fixed shapes; widen it for the uncertainty of the shapes.
        low, high = widened(value, (low, high), shape_widening(solution, own, relative, data))
    if detected and effect.white:
        low, high = widened_by_tails(value, (low, high), solution, data)
    return detected, (low, high)


def _profile(
    solution: Solution, own: Process, data: Data
) -> tuple[Array, Array, Array, Maximum, int]:
    """Arguments of `profile_interval` and `loss_at_zero` for the squared coefficient of a process."""
    # The profile uses the logL of the random part.
    part = RandomPart(data, solution.power, solution.count)
    best = replace(solution.best, log_likelihood=part.log_likelihood_of(solution.best))
    place = solution.processes.index(own)
    return solution.power, solution.count, solution.columns, best, place


def _loss_of_ordinates(solution: Solution, own: Process, data: Data) -> float:
    """Loss of logL, nats, at the single ordinates within the bins without a process; 0 unless it is a narrow band."""
    if not is_fitted_to_ordinates(own.effect, data):
        return 0.0
    less = Model(tuple(e for e in solution.model if e is not own.effect))
    with_it, without = (
        ordinates_delta_logl(tried, data, solution.ordinates, solution.count)
        for tried in (solution.model, less)
    )
    return with_it - without


def is_detected_in(solution: Solution, place: int, data: Data, slow: Callable[[], Laws]) -> bool:
    """True if the coefficients of the effect at index `place` are significantly different from 0, or not single numbers.

    Held values and modifiers count as detected, too, as in `estimates`, whose intervals take much longer. `slow` returns
    `slow_amplitudes` of the solution.
    """
    own = solution.effects[place]
    effect = own.effect
    if all(
        name in effect.held or not _is_number(effect.values[name])
        for name in (p.name for p in effect.parameters if p.role == "coefficient")
    ):
        return True
    if isinstance(own, Process):
        drop = logl_scale(solution, own, data) * loss_at_zero(*_profile(solution, own, data))
        drop = max(drop, 0.0) + _loss_of_ordinates(solution, own, data)
        return drop > min_detected_delta_logl(effect)
    if not isinstance(own, Regressed):
        return True
    # The noise takes most of the time, so it comes last.
    return _is_function_detected(own) and (
        not own.effect.low or _is_function_detected(own, slow()[own])
    )


def _is_function_detected(own: Regressed, law: Mixture | None = None) -> bool:
    """True if the amplitudes of a known function of time are significantly different from 0.

    ΔlogL must exceed `min_detected_delta_logl`. With the distribution `law` of its values under uncertain noise, the 99 %
    interval of a single amplitude must also exclude 0.
    Its shapes are then those of the fit: whether it exists does not depend on how well they are known.
    """
    inverse = np.linalg.pinv(own.covariance, hermitian=True)
    drop = 0.5 * float(own.amplitudes @ inverse @ own.amplitudes)
    detected = drop > min_detected_delta_logl(own.effect, own.amplitudes.size)
    if not detected or law is None or own.amplitudes.size > 1:
        return detected
    return not _includes_0(law.interval(0, DETECTION_P))


def _includes_0(interval: tuple[float, float]) -> bool:
    """True if 0 lies in an interval (low, high)."""
    return interval[0] <= 0.0 <= interval[1]


def _is_number(value: Any) -> bool:
    """True if a value of an effect is a single number: not unknown, text or several numbers."""
    return value is not None and not isinstance(value, (str, tuple))


def _log_interval(value: float, relative: float) -> tuple[float, float]:
    """95 % interval of a positive value whose logarithm has the standard error `relative`, at most e^±50 times it."""
    factor = float(np.exp(min(NORMAL * relative, MAX_LOG_HALF_WIDTH)))
    return value / factor, value * factor


def has_interval(value: Any) -> bool:
    """True if a value is an estimate with an interval."""
    return isinstance(value, Estimate) and value.interval is not None


def _extended_to_lowest(effect: Effect, name: str, found: Range, data: Data) -> Range:
    """Range of a shape; if the fit ended at the lower end of the search, from the lowest possible value on.

    The range then has no standard error. Ranges of narrow bands fitted to single ordinates are unchanged.
    """
    low = effect.parameter(name).low
    # Exponents are searched down to their lowest value, positive shapes down to half of the lowest grid value.
    tried = effect.grid(name, data.n, data.rate).min() / 2.0 if low >= 0.0 else low
    at_least = effect.values[name] <= tried + (MAX_RATIO_TO_SEARCH_END - 1.0) * abs(tried)
    if not at_least or is_fitted_to_ordinates(effect, data):
        return found
    return None, (low, found[1][1])


def widened(value: float, ends: tuple[float, float], factor: float) -> tuple[float, float]:
    """Pair (low, high): the interval `ends` widened by `factor` in ln(value), at most to e^±50 times the value.

    A low end of 0 stays 0.
    """

    def times(ratio: float) -> float:
        """`ratio` to the power of the outer `factor`, clipped to e^±`MAX_LOG_HALF_WIDTH`."""
        return float(
            np.exp(np.clip(factor * np.log(ratio), -MAX_LOG_HALF_WIDTH, MAX_LOG_HALF_WIDTH))
        )

    low, high = ends
    return value * times(low / value) if low > 0.0 else 0.0, value * times(high / value)


def _range(parameter: Parameter, value: float, error: float) -> tuple[float, tuple[float, float]]:
    """Pair: standard error of a value and its 95 % interval, within the range of the parameter.

    The interval of a positive shape, e.g. a time constant, is symmetric in the logarithm.
    """
    if parameter.role == "shape" and parameter.low > 0.0:
        return error, _log_interval(value, error / value)
    low, high = value - NORMAL * error, value + NORMAL * error
    return error, (max(low, parameter.low), min(high, parameter.high))


def _shape_ranges(effect: Effect, errors: dict[str, float]) -> Ranges:
    """Dict of the ranges of the free shapes of a random process or modifier that have an error in `errors`.

    The errors are those of ln(shape), or of the shape itself if it may be negative.
    """
    out: Ranges = {}
    for name in effect.free_shapes:
        if name in errors:
            declared, value = effect.parameter(name), effect.values[name]
            error = errors[name] if declared.low < 0.0 else value * errors[name]
            out[name] = _range(declared, value, error)
    return out


def _modifier_ranges(effect: Effect, errors: dict[str, float], data: Data) -> Ranges:
    """Dict of the ranges of the parameters of a modifier: the shapes in `errors`, and those of `Effect.errors`."""
    out = _shape_ranges(effect, errors)
    for name, error in effect.errors(data.rate).items():
        declared, value = effect.parameter(name), effect.values[name]
        if _is_number(value):
            _, (low, high) = _range(declared, value, error)
            if declared.unit == "s":
                low, high = max(low, data.span[0]), min(high, data.span[1])
            out[name] = error, (low, high)
    return out


def _function_ranges(solution: Solution, own: Regressed, data: Data) -> Ranges:
    """Dict of the ranges of a known function of time for the fitted noise; held values have no range."""
    effect, amplitudes, covariance = own.effect, own.amplitudes, own.covariance
    out: Ranges = {}
    for parameter in effect.parameters:
        name, value = parameter.name, effect.values[parameter.name]
        if not _is_number(value) or name in effect.held:
            continue
        if parameter.role == "shape":
            error = shape_error(own, name, solution, data)
        else:
            # An error of 0 means that the value does not depend on amplitudes, e.g. a count.
            error = _amplitude_error(effect, name, amplitudes, covariance) or None
            if error is not None and name == "phase" and "frequency" in out:
                # The phase at mid-record is uncorrelated with the frequency; at time 0 the error of the frequency adds.
                by_frequency = np.pi * abs(sum(data.span)) * (out["frequency"][0] or 0.0)
                error = float(np.hypot(error, by_frequency))
        if error is not None:
            out[name] = _range(parameter, value, error)
    return out


def _ranges_over_gaps(effect: Deterministic, ranges: Ranges, data: Data) -> Ranges:
    """Dict of the ranges of the times of an event that a gap of missing samples hides; they include the whole gap.

    A gap hides a time if the interval of this time touches the gap. If over nine tenths of an event lie in the gap, it
    hides all times of the event.
    The record does not show when the event happened within a gap, so these ranges have no standard error.
    """
    out: Ranges = {}
    names = [p.name for p in effect.parameters if p.unit == "s" and p.low <= 0.0]
    times = [name for name in names if _is_number(effect.values[name])]
    if data.missing is None or not effect.happens_once or not times:
        return out
    edges = np.flatnonzero(np.diff(data.missing, prepend=False, append=False)) / data.rate
    starts, ends = data.start + edges[::2] - 1.0 / data.rate, data.start + edges[1::2]
    first, *_, last = sorted(float(effect.values[name]) for name in (*times, *times))
    inside = np.minimum(ends, last) - np.maximum(starts, first)
    covered = inside > MIN_HIDDEN_FRACTION * (last - first)
    for name in ranges.keys() & times:
        low, high = ranges[name][1]
        touched = covered | ((starts <= high) & (ends >= low))
        if touched.any():
            ends_of_range = min(low, *starts[touched]), max(high, *ends[touched])
            out[name] = None, ends_of_range
    return out


def _amplitude_error(
    effect: Deterministic, name: str, amplitudes: Array, covariance: Array
) -> float | None:
    """Standard error of a value computed from amplitudes, by the delta method; None if the value is undefined or a text."""
    slope = np.zeros(amplitudes.size)
    for i in range(amplitudes.size):
        step = 1e-4 * max(
            float(np.sqrt(covariance[i, i])), abs(float(amplitudes[i])) * 1e-6, 1e-300
        )
        move = np.zeros(amplitudes.size)
        move[i] = step
        up = effect.with_amplitudes(amplitudes + move).values[name]
        down = effect.with_amplitudes(amplitudes - move).values[name]
        if up is None or down is None or isinstance(up, str):
            return None
        difference = up - down
        if effect.parameter(name).unit == "rad":
            difference = (difference + np.pi) % (2 * np.pi) - np.pi
        slope[i] = difference / (2 * step)
    return float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))


def shape_error(own: Regressed, name: str, solution: Solution, data: Data) -> float | None:
    """Standard error of a shape of a known function of time, in its unit; None if the record cannot determine it.

    Effects with edges, such as a step, have a formula for the error of their times in white noise (`Effect.shape_error`).
    For slow functions in other noise the formula is too large, so `_edge_error` is used instead, unless the formula gives
    less than the matched filter can resolve.
    """
    error = own.effect.shape_error(name, float(own.covariance[0, 0]), data.duration)
    if error is None:
        return deterministic_shape_error(own.effect, name, solution, data)
    if not own.effect.low or error < data.duration / FILTER_ORDINATES:
        return error
    return _edge_error(own.effect, name, solution, data)


def _edge_error(effect: Deterministic, name: str, solution: Solution, data: Data) -> float:
    """Standard error of the time of an edge of a slow function, s: root mean square distance from the fitted time.

    The mean is over the posterior of the time, ∝ exp(ΔlogL), with a uniform prior over the record and the other shapes as
    fitted. Noise that is slower than the edge hardly blurs it, which closed forms for white noise do not know.
    """
    fitted, (first, last) = float(effect.values[name]), data.span
    away = np.geomspace(1.0 / data.rate, data.duration, EDGE_TIMES)
    every = np.linspace(first, last, 2 * EDGE_TIMES)
    times = np.unique(np.concatenate([fitted - away, [fitted], fitted + away, every]))
    times = times[(times > first) & (times < last)]
    points = [effect.with_values(**{name: float(time)}) for time in times]
    others = [other for other in solution.model.deterministic if other != effect]
    left = data.ordinates_without(others)
    gains, _ = matched_gains(points, left, solution.noise(data), data, others)
    weight = np.gradient(times) * np.exp(gains - gains.max())
    return float(np.sqrt(weight @ (times - fitted) ** 2 / weight.sum()))


def deterministic_shape_error(
    effect: Deterministic, name: str, solution: Solution, data: Data
) -> float | None:
    """Standard error of a shape fitted together with the amplitudes; None if the record has no information on the shape.

    The derivative of the signal by the shape is projected (by GLS) orthogonal to the regressors. For effects that are not
    slow, e.g. a drifting line, it is also projected orthogonal to the derivatives by the other shapes.
    """
    here = design_of((effect,), data)
    target = shape_slope(effect, name, here.ordinates, data)
    if target is None:
        return None
    root = 1.0 / np.sqrt(solution.noise(data).variance(here.ordinates))
    directions = [here.matrix * root[:, None]]
    for other in () if effect.low else effect.free_shapes:
        slope = shape_slope(effect, other, here.ordinates, data) if other != name else None
        if slope is not None and slope.any():
            directions.append((slope * root / np.linalg.norm(slope * root))[:, None])
    white, target = np.hstack(directions), target * root
    coefficients, *_ = np.linalg.lstsq(white, target, rcond=None)
    orthogonal = target - white @ coefficients
    size = float(orthogonal @ orthogonal)
    return 1.0 / np.sqrt(size) if size > 0.0 else None

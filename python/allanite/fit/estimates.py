"""Standard errors, 95 % intervals and limits of fitted values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.parameters import NORMAL, Estimate
from allanite.common.printing import column_unit
from allanite.common.units import coefficient_unit
from allanite.effects import Deterministic, Model
from allanite.fit.covariance import joint_covariance, logl_scale, shape_widening
from allanite.fit.likelihood.heavy import widened_by_tails
from allanite.fit.likelihood.marginal import slow_amplitudes
from allanite.fit.likelihood.peaks import is_fitted_to_ordinates
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.whittle import profile_interval
from allanite.fit.shapes.narrow import ordinates_delta_logl
from allanite.fit.solution import Process, Regressed

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.marginal import Mixture
    from allanite.fit.solution import Solution

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


def free_parameters(solution: Solution) -> int:
    """Number of fitted parameters of the spectrum: free coefficients and shapes of processes, and shapes of modifiers.

    Processes with the coefficient 0 do not count.
    """
    count = 0
    for own in solution.processes:
        if own.theta > 0.0:
            effect = own.effect
            count += (effect.coefficient not in effect.held) + len(effect.free_shapes)
    return count + sum(len(effect.free_shapes) for effect in solution.model.modifiers)


def min_detected_delta_logl(effect: Effect, amplitudes: int = 1) -> float:
    """Rise of logL, nats, that an effect must bring to a fit to count as detected.

    It depends on whether the effect has free shapes, several fitted `amplitudes`, or a coefficient that may be negative.
    """
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
    unit: str,
    column_units: Mapping[str, str],
    places: Sequence[int] | None = None,
) -> tuple[dict[str, Any], ...]:
    """Tuple of a dict for each effect of the model: values by parameter name, numbers as `Estimate` with interval.

    `unit` is the unit of the samples; `column_units` are the known units of logged columns. With `places`, only the
    effects at these indices of the model are estimated.
    """
    names, covariance = joint_covariance(solution, data)
    shaped = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    out: list[dict[str, Any]] = []
    slow: dict[Regressed, Mixture] = {}
    if places is None:
        places = range(len(solution.effects))
    wanted = [solution.effects[place] for place in places]
    known = (own.effect for own in wanted if isinstance(own, Regressed))
    if any(e.low and not set(_amplitude_names(e)) <= set(e.held) for e in known):
        slow = slow_amplitudes(solution, data)
    for position, own in zip(places, wanted, strict=True):
        errors = {name: error for (place, name), error in shaped.items() if place == position}
        if isinstance(own, Process):
            out.append(_process_values(solution, own, errors, unit, data))
        elif isinstance(own, Regressed):
            values = _deterministic_values(solution, own, data, unit, column_units)
            if own in slow:
                values |= with_noise_uncertainty(own.effect, values, slow[own])
            out.append(values)
        else:
            out.append(_modifier_values(own.effect, errors, data, unit, column_units))
    return tuple(
        _with_admissible_intervals(own.effect, values)
        for own, values in zip(wanted, out, strict=True)
    )


def with_noise_uncertainty(
    effect: Deterministic, values: Mapping[str, Any], law: Mixture
) -> dict[str, Estimate]:
    """Dict of the amplitudes of a slow effect whose errors and intervals include the uncertainty of the noise coefficients.

    `law` is the distribution of the amplitudes averaged over the noise coefficients. If a fitted value lies outside the
    new interval, the interval is extended to the former one. Amplitudes without an interval are omitted.
    """
    out = {}
    for place, name in enumerate(_amplitude_names(effect)):
        value = values[name]
        if value.interval is not None:
            error, interval = law.standard_error(place), law.interval(place)
            if not interval[0] <= float(value) <= interval[1]:
                # Under equally likely noise another value is best; the interval includes both values.
                own = value.interval
                interval = min(interval[0], own[0]), max(interval[1], own[1])
            out[name] = Estimate(value.value, error, interval, value.unit, value.detected, name)
    return out


def _amplitude_names(effect: Deterministic) -> list[str]:
    """List of the names of the coefficients of a deterministic effect that are not None."""
    return [
        p.name
        for p in effect.parameters
        if p.role == "coefficient" and effect.values[p.name] is not None
    ]


def _process_values(
    solution: Solution, own: Process, errors: dict[str, float], unit: str, data: Data
) -> dict[str, Any]:
    """Dict of the values of a random process by parameter name: numbers as `Estimate`; tuples, texts and None unchanged.

    `errors` holds standard errors of ln(value) by parameter name. Derived parameters get the interval of the
    coefficient, scaled. Held values have no interval.
    """
    effect = own.effect
    coefficient = _coefficient(solution, own, errors.get(effect.coefficient), unit, data)
    detected, ends = coefficient.detected, coefficient.interval
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        name, value = parameter.name, effect.values[parameter.name]
        own_unit = parameter_unit(effect, name, unit)
        if name == effect.coefficient:
            out[name] = coefficient
        elif name in effect.free_shapes:
            found = _shape_estimate(effect, name, errors.get(name), detected, own_unit)
            out[name] = _extended_to_lowest(found, effect, data) if has_interval(found) else found
        elif _is_number(value):
            interval = None
            if parameter.role == "derived" and coefficient > 0.0 and ends is not None:
                interval = (value * ends[0] / coefficient, value * ends[1] / coefficient)
            out[name] = Estimate(value, None, interval, own_unit, detected, name)
        else:
            out[name] = value
    return out


def _coefficient(
    solution: Solution, own: Process, relative: float | None, unit: str, data: Data
) -> Estimate:
    """`Estimate` of the coefficient of a random process; `relative` is the standard error of its logarithm.

    A held coefficient counts as detected and has no error and no interval. If a coefficient is not detected, its
    interval starts at 0. The interval is wider for fitted shapes, and for white noise with heavy tails.
    """
    effect, name = own.effect, own.effect.coefficient
    value = float(np.sqrt(own.theta))
    own_unit = parameter_unit(effect, name, unit)
    if name in effect.held:
        return Estimate(value, None, None, own_unit, True, name)
    # The profile uses the logL of the random part.
    part = RandomPart(data, solution.power, solution.count)
    low, high, drop = profile_interval(
        solution.power,
        solution.count,
        solution.columns,
        replace(solution.best, log_likelihood=part.log_likelihood_of(solution.best)),
        solution.processes.index(own),
        logl_scale(solution, own, data),
    )
    low, high = float(np.sqrt(low)), float(np.sqrt(high))
    if is_fitted_to_ordinates(effect, data):
        # A narrow band is detected mainly by the single ordinates within the bins.
        model = solution.model
        less = Model(tuple(e for e in model if e is not effect))
        with_it, without = (
            ordinates_delta_logl(tried, data, solution.ordinates, solution.count)
            for tried in (model, less)
        )
        drop += with_it - without
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
    low, high = (effect.checked_limits.clipped(name, end) for end in (low, high))
    error = None if relative is None else value * relative
    return Estimate(value, error, (low, high), own_unit, detected, name)


def _is_number(value: Any) -> bool:
    """True if a value of an effect is a single number: not unknown, text or several numbers."""
    return value is not None and not isinstance(value, (str, tuple))


def _log_interval(value: float, relative: float) -> tuple[float, float]:
    """Pair: 95 % interval of a positive value whose logarithm has the standard error `relative`.

    The ends are at most e^±50 times the value.
    """
    factor = float(np.exp(min(NORMAL * relative, MAX_LOG_HALF_WIDTH)))
    return value / factor, value * factor


def has_interval(value: Any) -> bool:
    """True if a value is an estimate with an interval."""
    return isinstance(value, Estimate) and value.interval is not None


def _extended_to_lowest(value: Estimate, effect: Effect, data: Data) -> Estimate:
    """`Estimate` of a shape, with a wider interval and no standard error if the fit ended at the lower end of the search.

    The interval then starts at the lowest possible value of the shape. In all other cases the estimate is unchanged, also
    without an interval, and for narrow bands fitted to single ordinates.
    """
    low = effect.parameter(value.name).low
    # Exponents are searched down to their lowest value, positive shapes down to half of the lowest grid value.
    tried = effect.grid(value.name, data.n, data.rate).min() / 2.0 if low >= 0.0 else low
    at_least = value <= tried + (MAX_RATIO_TO_SEARCH_END - 1.0) * abs(tried)
    if not at_least or value.interval is None or is_fitted_to_ordinates(effect, data):
        return value
    high = value.interval[1]
    return Estimate(value.value, None, (low, high), value.unit, value.detected, value.name)


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


def _shape_estimate(
    effect: Effect, name: str, relative: float | None, detected: bool, own_unit: str
) -> Any:
    """`Estimate` of the shape parameter `name` of a fitted effect; a value of None or text is returned unchanged.

    `relative` is the standard error of ln(shape), or of the shape itself if it may be negative. With None, the estimate has
    no standard error and no interval. `detected` (of the effect) and the unit `own_unit` are passed on.
    """
    value = effect.values[name]
    if value is None or isinstance(value, str):
        return value
    if relative is None:
        return Estimate(value, None, None, own_unit, detected, name)
    declared = effect.parameter(name)
    if declared.low >= 0.0:
        interval = _log_interval(value, relative)
        return Estimate(value, value * relative, interval, own_unit, detected, name)
    low, high = value - NORMAL * relative, value + NORMAL * relative
    interval = max(low, declared.low), min(high, declared.high)
    return Estimate(value, relative, interval, own_unit, detected, name)


def _modifier_values(
    effect: Effect, shaped: dict[str, float], data: Data, unit: str, column_units: Mapping[str, str]
) -> dict[str, Any]:
    """Dict of the values of a modifier by parameter name: numbers as `Estimate`; tuples, texts and None unchanged.

    `shaped` holds standard errors of ln(shape) by name. Intervals of times are cut at the ends of the record.
    """
    errors = effect.errors(data.rate)
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        name, value = parameter.name, effect.values[parameter.name]
        own_unit = parameter_unit(effect, name, unit, column_units)
        if isinstance(value, tuple):
            out[name] = value
        elif name in errors and _is_number(value):
            low, high = value - NORMAL * errors[name], value + NORMAL * errors[name]
            if parameter.unit == "s":
                low, high = max(low, data.span[0]), min(high, data.span[1])
            out[name] = Estimate(value, errors[name], (low, high), own_unit, True, name)
        else:
            out[name] = _shape_estimate(effect, name, shaped.get(name), True, own_unit)
    return out


def _deterministic_values(
    solution: Solution, own: Regressed, data: Data, unit: str, column_units: Mapping[str, str]
) -> dict[str, Any]:
    """Dict of the values of a deterministic effect by parameter name: numbers as `Estimate`, other values unchanged.

    Held values count as detected and have no interval. Intervals are ±1.96 errors, symmetric in the logarithm for
    positive shapes, and cut at 0 for values that cannot be negative.
    """
    effect, amplitudes, covariance = own.effect, own.amplitudes, own.covariance
    drop = 0.5 * float(amplitudes @ np.linalg.pinv(covariance, hermitian=True) @ amplitudes)
    detected = drop > min_detected_delta_logl(effect, amplitudes.size)
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        value = effect.values[parameter.name]
        own_unit = parameter_unit(effect, parameter.name, unit, column_units)
        if not _is_number(value):
            out[parameter.name] = value
            continue
        if parameter.name in effect.held:
            out[parameter.name] = Estimate(value, None, None, own_unit, True, parameter.name)
            continue
        if parameter.role == "shape":
            error = _shape_error(own, parameter.name, solution, data)
        else:
            # An error of 0 means that the value does not depend on amplitudes, e.g. a count.
            error = _amplitude_error(effect, parameter.name, amplitudes, covariance) or None
            if error is not None and parameter.name == "phase":
                error = float(np.hypot(error, _phase_by_frequency(own, solution, data)))
        interval = None if error is None else (value - NORMAL * error, value + NORMAL * error)
        if error is not None and parameter.role == "shape" and parameter.low > 0.0:
            # The interval of a positive shape, e.g. a time constant, is symmetric in the logarithm.
            interval = _log_interval(value, error / value)
        elif interval is not None and parameter.low == 0.0:
            interval = (max(0.0, interval[0]), interval[1])
        out[parameter.name] = Estimate(value, error, interval, own_unit, detected, parameter.name)
    return out


def _phase_by_frequency(own: Regressed, solution: Solution, data: Data) -> float:
    """Standard error of a line's phase at time 0 caused by the error of its frequency, rad.

    It is 0 if the frequency is fixed or its error is unknown. The phase at the middle of the record is uncorrelated with
    the frequency. Extrapolated to time 0, the error of the frequency adds to the phase.
    """
    if "frequency" not in own.effect.free_shapes:
        return 0.0
    error = _shape_error(own, "frequency", solution, data)
    return 0.0 if error is None else 2.0 * np.pi * abs(sum(data.span) / 2.0) * error


def _amplitude_error(
    effect: Deterministic, name: str, amplitudes: Array, covariance: Array
) -> float | None:
    """Standard error of a value computed from amplitudes, by the delta method; None if the value is undefined or a text.

    0 if the value does not depend on the amplitudes.
    """
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


def _shape_error(own: Regressed, name: str, solution: Solution, data: Data) -> float | None:
    """Standard error of a shape of a known function of time, in its unit; None if the record cannot determine it.

    It is the closed form of the effect, if it declares one (`Effect.shape_error`), else `deterministic_shape_error`.
    """
    error = own.effect.shape_error(name, float(own.covariance[0, 0]), data.duration)
    return deterministic_shape_error(own.effect, name, solution, data) if error is None else error


def deterministic_shape_error(
    effect: Deterministic, name: str, solution: Solution, data: Data
) -> float | None:
    """Standard error of a shape fitted together with the amplitudes; None if the record has no information on the shape.

    The derivative of the signal by the shape is projected (by GLS) orthogonal to the regressors. For effects that are
    not slow, e.g. a drifting line, it is also projected orthogonal to the derivatives by the other shapes.
    """
    from allanite.fit.shapes.deterministic import design_of

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


def shape_slope(
    effect: Deterministic, name: str, ordinates: NDArray[np.int64], data: Data
) -> Array | None:
    """Array of the derivative of an effect's cosine ordinates with respect to the shape `name`, shape of `ordinates`.

    None if the shape cannot be changed.
    """
    from allanite.fit.shapes.deterministic import regressors_at

    value = effect.values[name]
    steps = {"Hz": 1e-4 / data.duration, "Hz/s": 1e-4 / data.duration**2}
    steps["s"] = max(
        1e-3 * abs(value), 1.0 / data.rate
    )  # a smaller step than a sample changes nothing
    step = steps.get(str(effect.parameter(name).unit), 1e-3 * abs(value))
    if step == 0.0:
        return None
    try:
        moved = [effect.with_values(**{name: value + s}) for s in (step, -step)]
    except ValueError:
        return None
    up, down = (regressors_at(m, ordinates, data) for m in moved)
    return np.asarray((up - down) @ effect.amplitudes() / (2.0 * step))


def _with_admissible_intervals(effect: Effect, values: dict[str, Any]) -> dict[str, Any]:
    """Dict of the values of an effect by name, with intervals clipped to the limits that the user gave.

    If the effect is not detected, its shapes, times and all values in Hz, s or rad have no interval and standard error.
    """
    out = dict(values)
    for name, value in values.items():
        if not isinstance(value, Estimate) or value.interval is None:
            continue
        declared = effect.parameter(name)
        is_shape = declared.role in ("shape", "time") or declared.unit in ("Hz", "s", "rad")
        if not value.detected and is_shape:
            # The frequency of a line that does not exist has no true value.
            out[name] = Estimate(value.value, None, None, value.unit, False, name)
        elif name in effect.limits:
            low, high = (effect.checked_limits.clipped(name, end) for end in value.interval)
            out[name] = Estimate(
                value.value, value.std_error, (low, high), value.unit, value.detected, name
            )
    return out

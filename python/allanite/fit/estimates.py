"""Standard errors, 95 % intervals and limits of fitted values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.parameters import NORMAL, Estimate
from allanite.common.printing import column_unit
from allanite.common.units import coefficient_unit
from allanite.effects import Model
from allanite.fit.covariance import joint_covariance, shape_widening, told
from allanite.fit.interval_ends import with_ends
from allanite.fit.likelihood.heavy import widened_by_tails
from allanite.fit.likelihood.marginal import slow_amplitudes
from allanite.fit.likelihood.peaks import is_fitted_to_ordinates
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.whittle import profile_interval
from allanite.fit.shapes.narrow import ordinates_delta_logl
from allanite.fit.solution import Process, Regressed

if TYPE_CHECKING:
    from allanite.effects import Deterministic, Effect
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.marginal import Mixture
    from allanite.fit.solution import Solution

__all__ = ["estimates", "free_parameters", "shape_slope", "widened"]

#: A coefficient is detected where leaving it out costs this much logL: 1 % of ½χ²₁.
DETECTED = 2.706
#: The same for an effect that brings a shape or a phase of its own: 1 % of χ²₂.
DETECTED_SHAPED = 4.605
#: The same for one amplitude of either sign: 1 % of χ²₁, 6.635/2.
DETECTED_SIGNED = 3.317
#: A shape is at an end of what is searched if it is this near to it.
AT_END = 1.001
#: Ends of the interval of a value that is not known at all, in ln.
UNKNOWN = 50.0


def free_parameters(solution: Solution) -> int:
    """Fitted numbers that shape the expected bin power: active coefficients and their shapes."""
    count = 0
    for own in solution.processes:
        if own.theta > 0.0:
            effect = own.effect
            count += (effect.coefficient not in effect.held) + len(effect.free_shapes)
    return count + sum(len(effect.free_shapes) for effect in solution.model.modifiers)


def _unit(
    effect: Effect, name: str, sample_unit: str, column_units: Mapping[str, str] | None = None
) -> str:
    declared = effect.parameter(name).unit
    if not isinstance(declared, str):
        return coefficient_unit(sample_unit, declared)
    if "unit" in declared:
        explains = str(effect.follows)
        per = column_unit(explains, (column_units or {}).get(explains))
        declared = declared.replace("unit", per)
    return sample_unit + declared[1:] if declared.startswith("U") else declared


def estimates(
    solution: Solution, data: Data, unit: str, column_units: Mapping[str, str]
) -> tuple[dict[str, Any], ...]:
    """For each effect of the model its values by JSON name, as `Estimate` where they are numbers.

    `unit` is that of the samples, `column_units` those of the covariates that are known.
    """
    shaped = _shape_errors(solution, data)
    out: list[dict[str, Any]] = []
    slow: dict[Regressed, Mixture] = {}
    if any(e.low and not _all_held(e) for e in solution.model.deterministic):
        slow = slow_amplitudes(solution, data)
    for position, own in enumerate(solution.effects):
        errors = {name: error for (place, name), error in shaped.items() if place == position}
        if isinstance(own, Process):
            out.append(_stochastic(solution, own, errors, unit, data))
        elif isinstance(own, Regressed):
            values = _deterministic(solution, own, data, unit, column_units)
            if own in slow:
                values |= _averaged(own.effect, values, slow[own])
            out.append(values)
        else:
            out.append(_modifier(own.effect, errors, data, unit, column_units))
    return tuple(
        with_ends(own.effect, values) for own, values in zip(solution.effects, out, strict=True)
    )


def _averaged(
    effect: Deterministic, values: Mapping[str, Any], law: Mixture
) -> dict[str, Estimate]:
    """Amplitudes with what not knowing the noise adds to their intervals."""
    out = {}
    for place, name in enumerate(_amplitude_names(effect)):
        value = values[name]
        if value.interval is not None:
            error, interval = law.standard_error(place), law.interval(place)
            if not interval[0] <= float(value) <= interval[1]:
                # With other noise that is as likely another value is the best: the interval holds that and this one.
                own = value.interval
                interval = min(interval[0], own[0]), max(interval[1], own[1])
            out[name] = Estimate(value.value, error, interval, value.unit, value.detected, name)
    return out


def _amplitude_names(effect: Deterministic) -> list[str]:
    return [
        p.name
        for p in effect.parameters
        if p.role == "coefficient" and effect.values[p.name] is not None
    ]


def _all_held(effect: Deterministic) -> bool:
    return set(_amplitude_names(effect)) <= set(effect.held)


def _shape_errors(solution: Solution, data: Data) -> dict[tuple[int, str], float]:
    """Standard errors of ln(shape) (a signed shape: of itself) and, under its own name, of ln(coefficient)."""
    names, inverse = joint_covariance(solution, data)
    return dict(zip(names, map(float, np.sqrt(np.diag(inverse))), strict=True))


def _stochastic(
    solution: Solution, own: Process, shaped: dict[str, float], unit: str, data: Data
) -> dict[str, Any]:
    effect, name = own.effect, own.effect.coefficient
    value = float(np.sqrt(own.theta))
    own_unit = _unit(effect, name, unit)
    out: dict[str, Any] = {}
    if name in effect.held:
        out[name] = Estimate(value, None, None, own_unit, True, name)
        low = high = value
        detected = True
    else:
        # logL of the random part alone.
        part = RandomPart(data, solution.power, solution.count)
        here = replace(solution.best, log_likelihood=part.judged(solution.best))
        low, high, drop = profile_interval(
            solution.power,
            solution.count,
            solution.columns,
            here,
            solution.processes.index(own),
            told(solution, own, data),
        )
        low, high = float(np.sqrt(low)), float(np.sqrt(high))
        if is_fitted_to_ordinates(effect, data):
            # Bins hardly show it: the ordinates within them do.
            drop += _beyond_bins(solution, own, data)
        detected = drop > (DETECTED_SHAPED if effect.free_shapes else DETECTED)
        relative = shaped.get(name)
        error = None if relative is None else value * relative
        if detected and relative is not None and not low:
            spread = float(np.exp(min(NORMAL * relative, UNKNOWN)))
            low, high = value / spread, value * spread
        elif detected and relative is not None:
            # The profile is at fixed shapes: widened by what not knowing them adds to the standard error.
            low, high = widened(value, (low, high), shape_widening(solution, own, relative, data))
        if not detected:
            low = 0.0
        elif effect.white:
            low, high = widened_by_tails(value, (low, high), solution, data)
        low, high = (effect.limits.clipped(name, end) for end in (low, high))
        out[name] = Estimate(value, error, (low, high), own_unit, detected, name)
    for shape in effect.free_shapes:
        found = _shape(effect, shape, shaped.get(shape), detected, _unit(effect, shape, unit))
        out[shape] = _at_its_least(found, effect, data) if _estimated(found) else found
    for parameter in effect.parameters:
        if parameter.name in out:
            continue
        number = effect.values[parameter.name]
        if number is None or isinstance(number, (str, tuple)):
            out[parameter.name] = number
            continue
        interval = None
        if parameter.role == "derived" and value > 0.0 and name not in effect.held:
            interval = (number * low / value, number * high / value)
        out[parameter.name] = Estimate(
            float(number),
            None,
            interval,
            _unit(effect, parameter.name, unit),
            detected,
            parameter.name,
        )
    return {p.name: out[p.name] for p in effect.parameters}


def _beyond_bins(solution: Solution, own: Process, data: Data) -> float:
    """By how much logL of the ordinates given the power of their bins falls without a narrow band."""
    model = solution.model
    less = Model(tuple(e for e in model if e is not own.effect))
    with_it, without = (
        ordinates_delta_logl(tried, data, solution.ordinates, solution.count)
        for tried in (model, less)
    )
    return with_it - without


def _estimated(value: Any) -> bool:
    return isinstance(value, Estimate) and value.interval is not None


def _at_its_least(value: Estimate, effect: Effect, data: Data) -> Estimate:
    """A shape, with an interval down to its lowest value where a fit found it at the lowest that it tries."""
    low = effect.parameter(value.name).low
    # An exponent is tried down to its lowest value, a positive shape to half of its grid's.
    tried = effect.grid(value.name, data.n, data.rate).min() / 2.0 if low >= 0.0 else low
    at_least = value <= tried + (AT_END - 1.0) * abs(tried)
    if not at_least or value.interval is None or is_fitted_to_ordinates(effect, data):
        return value
    high = value.interval[1]
    return Estimate(value.value, None, (low, high), value.unit, value.detected, value.name)


def widened(value: float, ends: tuple[float, float], factor: float) -> tuple[float, float]:
    """Widen an interval by `factor` in ln(value), clipped at e^±`UNKNOWN`."""

    def times(ratio: float) -> float:
        return float(np.exp(np.clip(factor * np.log(ratio), -UNKNOWN, UNKNOWN)))

    low, high = ends
    return value * times(low / value) if low > 0.0 else 0.0, value * times(high / value)


def _shape(effect: Effect, name: str, relative: float | None, detected: bool, own_unit: str) -> Any:
    value = effect.values[name]
    if value is None or isinstance(value, str):
        return value
    if relative is None:
        return Estimate(float(value), None, None, own_unit, detected, name)
    declared = effect.parameter(name)
    if declared.low < 0.0:
        interval = (
            max(value - NORMAL * relative, declared.low),
            min(value + NORMAL * relative, declared.high),
        )
        return Estimate(float(value), relative, interval, own_unit, detected, name)
    spread = float(np.exp(min(NORMAL * relative, UNKNOWN)))
    return Estimate(
        float(value),
        float(value * relative),
        (value / spread, value * spread),
        own_unit,
        detected,
        name,
    )


def _modifier(
    effect: Effect,
    shaped: dict[str, float],
    data: Data,
    unit: str,
    column_units: Mapping[str, str],
) -> dict[str, Any]:
    errors = effect.errors(data.rate)
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        name, value = parameter.name, effect.values[parameter.name]
        own_unit = _unit(effect, name, unit, column_units)
        if isinstance(value, (tuple, str)) or value is None or name not in errors:
            out[name] = (
                value
                if isinstance(value, tuple)
                else _shape(effect, name, shaped.get(name), True, own_unit)
            )
            continue
        low, high = value - NORMAL * errors[name], value + NORMAL * errors[name]
        if effect.parameter(name).unit == "s":
            low, high = max(low, data.span[0]), min(high, data.span[1])
        out[name] = Estimate(value, errors[name], (low, high), own_unit, True, name)
    return out


def _deterministic(
    solution: Solution,
    own: Regressed,
    data: Data,
    unit: str,
    column_units: Mapping[str, str],
) -> dict[str, Any]:
    effect, amplitudes, covariance = own.effect, own.amplitudes, own.covariance
    drop = 0.5 * float(amplitudes @ np.linalg.pinv(covariance, hermitian=True) @ amplitudes)
    detected = drop > (
        DETECTED_SHAPED if amplitudes.size > 1 or effect.free_shapes else DETECTED_SIGNED
    )
    out: dict[str, Any] = {}
    for parameter in effect.parameters:
        value = effect.values[parameter.name]
        own_unit = _unit(effect, parameter.name, unit, column_units)
        if value is None or isinstance(value, (str, tuple)):
            out[parameter.name] = value
            continue
        if parameter.name in effect.held:
            out[parameter.name] = Estimate(float(value), None, None, own_unit, True, parameter.name)
            continue
        if parameter.role == "shape":
            error = effect.shape_error(parameter.name, float(covariance[0, 0]), data.duration)
            if error is None:
                error = _deterministic_shape_error(effect, parameter.name, solution, data)
        else:
            # 0 is that of what does not depend on amplitudes: a count.
            error = _amplitude_error(effect, parameter.name, amplitudes, covariance) or None
            if error is not None and parameter.name == "phase":
                error = float(np.hypot(error, _phase_by_frequency(effect, own, solution, data)))
        interval = None if error is None else (value - NORMAL * error, value + NORMAL * error)
        if error is not None and parameter.role == "shape" and parameter.low > 0.0:
            # Times are known to a factor.
            factor = float(np.exp(min(NORMAL * error / value, 50.0)))
            interval = (value / factor, value * factor)
        elif interval is not None and parameter.low == 0.0:
            interval = (max(0.0, interval[0]), interval[1])
        out[parameter.name] = Estimate(
            float(value), error, interval, own_unit, detected, parameter.name
        )
    return out


def _phase_by_frequency(
    effect: Deterministic, own: Regressed, solution: Solution, data: Data
) -> float:
    """What the error of the frequency adds to that of the phase at time 0, rad.

    The phase at the middle of the record is independent of the frequency; from there to time 0 the line turns.
    """
    if "frequency" not in effect.free_shapes:
        return 0.0
    error = effect.shape_error("frequency", float(own.covariance[0, 0]), data.duration)
    if error is None:
        error = _deterministic_shape_error(effect, "frequency", solution, data)
    return 0.0 if error is None else 2.0 * np.pi * abs(sum(data.span) / 2.0) * error


def _amplitude_error(
    effect: Deterministic,
    name: str,
    amplitudes: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> float | None:
    """Delta method through the effect's own map from amplitudes to values."""
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


def _deterministic_shape_error(
    effect: Deterministic, name: str, solution: Solution, data: Data
) -> float | None:
    """From the information of the shape with the amplitudes: d signal/d shape, GLS-projected on the regressors.

    And, for a line that drifts, on the slope of its other shape: frequency at the start and drift go together.
    """
    from allanite.fit.shapes.deterministic import design_of

    here = design_of((effect,), data)
    target = shape_slope(effect, name, here.ordinates, data)
    if target is None:
        return None
    root = 1.0 / np.sqrt(solution.noise(data).variance(here.ordinates))
    beside = [here.matrix * root[:, None]]
    for other in () if effect.low else effect.free_shapes:
        slope = shape_slope(effect, other, here.ordinates, data) if other != name else None
        if slope is not None and slope.any():
            beside.append((slope * root / np.linalg.norm(slope * root))[:, None])
    white, target = np.hstack(beside), target * root
    coefficients, *_ = np.linalg.lstsq(white, target, rcond=None)
    rest = target - white @ coefficients
    size = float(rest @ rest)
    return 1.0 / np.sqrt(size) if size > 0.0 else None


def shape_slope(
    effect: Deterministic, name: str, ordinates: NDArray[np.int64], data: Data
) -> NDArray[np.float64] | None:
    """Change of the effect's ordinates with one of its shapes; None where it cannot be moved."""
    from allanite.fit.shapes.deterministic import design_of

    value = effect.values[name]
    steps = {"Hz": 1e-4 / data.duration, "Hz/s": 1e-4 / data.duration**2}
    steps["s"] = max(1e-3 * abs(value), 1.0 / data.rate)  # less than a sample moves nothing
    step = steps.get(str(effect.parameter(name).unit), 1e-3 * abs(value))
    if step == 0.0:
        return None
    try:
        moved = [effect.with_values(**{name: value + s}) for s in (step, -step)]
    except ValueError:
        return None
    up, down = (design_of((m,), data, ordinates).matrix for m in moved)
    return np.asarray((up - down) @ effect.amplitudes() / (2.0 * step))

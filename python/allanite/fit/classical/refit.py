"""Fits with coefficients from a classical method: GLS on the Allan variance, or straight lines.

Shapes and deterministic effects come from the Whittle fit, and the coefficients of random processes from the classical
method. The misfit is that of the resulting model on the spectrum, so that methods can be compared.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import coefficient_unit
from allanite.deviation import oadev
from allanite.fit.classical.gls import fit_gls, gls_factors
from allanite.fit.classical.lines import read_lines
from allanite.fit.covariance import shape_widening
from allanite.fit.estimates import DETECTION_P, widened
from allanite.fit.likelihood.whittle import log_likelihood
from allanite.fit.solution import Fitted, Process, Regressed

if TYPE_CHECKING:
    from allanite.fit.result import Fit


def refit(fit: Fit, method: str) -> Fit:
    """Copy of the Whittle fit with coefficients of the method ``gls`` or ``lines``, its likelihood, and no discrepancy.

    `InputError` for held values or limits, and, for ``lines``, for effects other than Q, N, B, K, R.
    """
    if any(e.hold or e.limits for e in fit.model):
        raise InputError(f"method {method!r} does not support held values or limits; use whittle")
    values = _gls_estimates(fit) if method == "gls" else _line_estimates(fit)
    solution, bins = fit.solution, fit.data.bins
    effects = tuple(_with_values(own, v) for own, v in zip(solution.effects, values, strict=True))
    changed = replace(solution, effects=effects, scale=None, weight=solution.count)
    spectrum = np.maximum(changed.columns @ changed.theta, 1e-300)
    value = log_likelihood(bins.power(solution.ordinates), bins.count, spectrum)
    changed = replace(changed, spectrum=spectrum, maximum=value, log_likelihood=value)
    return replace(fit, model=changed.model, method=method, solution=changed, given=values)


def _with_values(own: Fitted, values: dict[str, Any]) -> Fitted:
    """Copy of a fitted effect with the coefficient in `values`; the effect itself if the method does not estimate it."""
    if isinstance(own, Process):
        name = own.effect.coefficient
        value = float(values[name])
        return replace(own, effect=own.effect.with_values(**{name: value}), theta=value**2)
    if isinstance(own, Regressed) and own.effect.standard is not None:
        name = own.effect.standard.name
        effect = own.effect.with_values(**{name: float(values[name])})
        return replace(own, effect=effect, amplitudes=effect.amplitudes())
    return own


def _gls_estimates(fit: Fit) -> tuple[dict[str, Any], ...]:
    """Tuple of a dict of estimates by parameter name for each effect, with coefficients of random processes by GLS.

    A coefficient is detected if p < 1 %; otherwise its interval starts at 0. Values derived from a coefficient are rescaled
    with it. All other values are those of `fit`.
    """
    data, model = fit.data, fit.model
    factors = gls_factors(data.n)
    curve = oadev(data.residual(model), rate=data.rate, factors=factors)
    found = fit_gls(
        curve.deviation**2, factors, data.n, [data.unit_terms(model, e) for e in model.stochastic]
    )
    low, high, p_values = found.intervals()
    out = []
    for fitted, values in zip(fit.solution.effects, fit.estimates, strict=True):
        own = dict(values)
        if isinstance(fitted, Process):
            effect, place = fitted.effect, fit.solution.processes.index(fitted)
            value = float(found.coefficients[place])
            detected = bool(p_values[place] < DETECTION_P)
            ends = float(low[place]) if detected else 0.0, float(high[place])
            error = float(found.std_errors[place]) / (2.0 * value) if value > 0 else None
            given = values[effect.coefficient]
            if effect.free_shapes and detected and given.std_error and error is not None:
                # Shapes come from the Whittle fit, and so does the widening for their uncertainty.
                relative = given.std_error / max(float(given), 1e-300)
                factor = shape_widening(fit.solution, fitted, relative, fit.data)
                error *= factor
                ends = widened(value, ends, factor)
            own[effect.coefficient] = Estimate(
                value, error, ends, given.unit, detected, effect.coefficient
            )
            for parameter in effect.parameters:
                derived = own[parameter.name]
                if parameter.role == "derived" and isinstance(derived, Estimate) and float(given):
                    own[parameter.name] = _rescaled(derived, own[effect.coefficient], float(given))
        out.append(own)
    return tuple(out)


def _rescaled(derived: Estimate, coefficient: Estimate, before: float) -> Estimate:
    """`Estimate` of a derived value that is proportional to a coefficient, which was `before`, without standard error."""
    ratio = float(derived) / before
    interval = coefficient.interval
    return Estimate(
        float(coefficient) * ratio,
        None,
        None if interval is None else (interval[0] * ratio, interval[1] * ratio),
        derived.unit,
        coefficient.detected,
        derived.name,
    )


def _line_estimates(fit: Fit) -> tuple[dict[str, Any], ...]:
    """Tuple of a dict {name: Estimate} for each effect: the coefficient read from its straight line on the Allan curve.

    0 if the curve does not show the line.
    """
    other = [e.kind for e in fit.model if e.standard is None]
    if other:
        raise InputError(
            f"method 'lines' supports Q, N, B, K, R, but the model has {other[0]}; use whittle or gls"
        )
    data = fit.data
    readings = read_lines(oadev(data.samples, rate=data.rate, taus=8))
    out = []
    for effect in fit.model:
        assert effect.standard is not None
        name = effect.standard.name
        power = effect.parameter(name).unit
        assert not isinstance(power, str)
        unit = coefficient_unit(fit.recording.unit, power)
        out.append({name: readings[name].estimate(unit)})
    return tuple(out)

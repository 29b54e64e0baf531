"""Fit parameters within limits (given by the user or the range of a shape) by an active-set method.

All parameters are fitted freely. Parameters beyond a limit are then held at the limit, and the others are fitted again,
until none is beyond. Finally each is released if that raises logL and keeps all parameters within their limits (Gill,
Murray & Wright 1981, section 5.2).
"""

from __future__ import annotations

from dataclasses import replace
from math import isclose
from typing import TYPE_CHECKING

from allanite.effects import LIMIT_TOLERANCE, Deterministic, Effect, Limits, Model

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.solution import Solution

#: Minimum ΔlogL to release a parameter from its limit. Chosen by judgment; not measured.
MIN_RELEASE_DELTA_LOGL = 1e-3

#: Parameters held at a limit: (index of the effect, name) → limit.
Held = dict[tuple[int, str], float]


def within_limits(model: Model, fit: Callable[[Model], Solution]) -> Solution:
    """`Solution` of a model with all parameters within their limits; `fit` fits a model without regard to limits.

    `Effect.at_limit` of the result names the parameters at a limit.
    """
    model = Model(tuple(_clipped_to_limits(effect) for effect in model))
    found = fit(model)
    held, found = _hold_until_inside(model, {}, found, fit)
    # A single held parameter was beyond its limit with all others free; releasing it would not help.
    while len(held) > 1:
        tries = (_with_released(model, held, key, found, fit) for key in held)
        better = next((one for one in tries if one is not None), None)
        if better is None:
            break
        held, found = better
    return _held_at_limits(found, held)


def _hold_until_inside(
    model: Model, held: Held, found: Solution, fit: Callable[[Model], Solution]
) -> tuple[Held, Solution]:
    """Pair (held, solution): values of the held parameters, and a solution in which no other parameter is beyond a limit.

    If the fit reached all limits exactly, the parameters are held without a new fit.
    """
    while beyond := _beyond_limits(found.model, held):
        held = {**held, **beyond}
        reached = ((found.model.effects[at], name, end) for (at, name), end in beyond.items())
        if all(_has_reached(*one) for one in reached):
            found = _held_at_limits(found, held)
        else:
            found = fit(_with_held(model, found.model, held))
    return held, found


def _with_released(
    model: Model,
    held: Held,
    key: tuple[int, str],
    found: Solution,
    fit: Callable[[Model], Solution],
) -> tuple[Held, Solution] | None:
    """Pair (held parameters, solution) after the parameter `key` (effect index, name) is fitted freely; or None.

    None if the solution violates a limit, or if logL rises by less than 1e-3.
    """
    remaining = {k: value for k, value in held.items() if k != key}
    tried = fit(_with_held(model, found.model, remaining))
    if (
        _beyond_limits(tried.model, remaining)
        or tried.log_likelihood < found.log_likelihood + MIN_RELEASE_DELTA_LOGL
    ):
        return None
    return remaining, tried


def _has_reached(effect: Effect, name: str, limit: float) -> bool:
    """True if the shape parameter `name` equals `limit`, an end of its declared range; False for limits of the user."""
    at_end = isclose(effect.values[name], limit, rel_tol=10.0 * LIMIT_TOLERANCE)
    return at_end and name not in effect.limits


def _held_at_limits(found: Solution, held: Held) -> Solution:
    """Copy of the solution in which the parameters `held` have exactly the values of their limits; no new fit.

    A fitted value may differ from its limit by rounding.
    """
    effects = list(found.effects)
    for place in {place for place, _ in held}:
        values = {name: value for (at, name), value in held.items() if at == place}
        own = effects[place]
        made = own.effect.with_values(**values, at_limit=tuple(values))
        effects[place] = replace(own, effect=made)
    return replace(found, effects=tuple(effects))


def _beyond_limits(model: Model, held: Held) -> Held:
    """Dict from (effect index, name) to the limit, of parameters at or beyond a limit that are not held yet.

    Limits are those of the user, and for shapes of random effects and modifiers also the ends of their declared range.
    """
    out = {}
    for place, effect in enumerate(model):
        shapes = () if isinstance(effect, Deterministic) else effect.free_shapes
        for name in dict.fromkeys((*effect.limits, *shapes)):
            value = effect.values[name]
            if name in effect.hold or (place, name) in held or value is None:
                continue
            limit = effect.checked_limits.reached(name, value)
            if limit is None and name in shapes:
                declared = effect.parameter(name)
                limit = Limits({name: (declared.low, declared.high)}).reached(name, value)
            if limit is not None:
                out[place, name] = limit
    return out


def _clipped_to_limits(effect: Effect) -> Effect:
    """Copy of the effect with start values clipped to the limits of the user, and with no parameter held at a limit."""
    if not effect.limits and not effect.at_limit:
        return effect
    values = {
        name: effect.checked_limits.clipped(name, value)
        for name in effect.limits
        if (value := effect.values[name]) is not None
    }
    return effect.with_values(**values, at_limit=())


def _with_held(model: Model, found: Model, held: Held) -> Model:
    """Copy of the model to fit next, in which the parameters `held` are fixed at their limits.

    `model` has the given values, `found` the fitted ones. Random effects that the user limited start again from the given
    values. All other effects with a held parameter start from the fitted values, because a new search of their other shapes
    could end elsewhere.
    """
    effects = list(model.effects)
    for place, effect in enumerate(effects):
        values = {name: value for (at, name), value in held.items() if at == place}
        if values:
            # Amplitudes and phase are held together, so that those not at a limit need values.
            is_limited = not isinstance(effect, Deterministic) and values.keys() & effect.limits
            base = effect if is_limited else found.effects[place]
            effects[place] = base.with_values(**values, at_limit=tuple(values))
    return Model(tuple(effects))

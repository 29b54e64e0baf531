"""Numbers that must stay within limits, given ones or those of the range of a shape: an active set.

All are fitted freely; those beyond their limits are held at the nearer one and the rest is fitted again, until none is
beyond. Then each is let go again where that raises logL and leaves it, and all others, within their limits (Gill, Murray &
Wright 1981, section 5.2).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Model
from allanite.effects._limits import Limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.effects import Effect
    from allanite.fit.solution import Solution

__all__ = ["within_limits"]

#: What of logL letting a number go must gain.
GAIN = 1e-3

#: Numbers held at a limit, and at which: (place in the model, name) → value.
Held = dict[tuple[int, str], float]


def within_limits(model: Model, fit: Callable[[Model], Solution]) -> Solution:
    """The fit whose numbers are all within the limits of the model; `fit` is one that does not look at them.

    Numbers at a limit are told by `Effect.at_limit`.
    """
    model = Model(tuple(_moved_in(effect) for effect in model))
    found = fit(model)
    held, found = _all_in(model, {}, found, fit)
    # What was held alone was beyond its limit with all others free.
    while len(held) > 1:
        tries = (_let_go(model, held, key, found, fit) for key in held)
        better = next((one for one in tries if one is not None), None)
        if better is None:
            break
        held, found = better
    return _exactly(found, held)


def _all_in(
    model: Model, held: Held, found: Solution, fit: Callable[[Model], Solution]
) -> tuple[Held, Solution]:
    """With ever more numbers held, until none is beyond its limits."""
    while beyond := _beyond(found.model, held):
        held = {**held, **beyond}
        found = fit(_holding(model, found.model, held))
    return held, found


def _let_go(
    model: Model,
    held: Held,
    key: tuple[int, str],
    found: Solution,
    fit: Callable[[Model], Solution],
) -> tuple[Held, Solution] | None:
    """The fit without one of the numbers held; None where it is none, or no better."""
    rest = {k: value for k, value in held.items() if k != key}
    tried = fit(_holding(model, found.model, rest))
    if _beyond(tried.model, rest) or tried.log_likelihood < found.log_likelihood + GAIN:
        return None
    return rest, tried


def _exactly(found: Solution, held: Held) -> Solution:
    """With the numbers held at just their limits: an amplitude that was a sine and a cosine is off by a rounding."""
    effects = list(found.effects)
    for (place, name), value in held.items():
        own = effects[place]
        if own.effect.values[name] != value:
            effects[place] = replace(own, effect=own.effect.with_values(**{name: value}))
    return replace(found, effects=tuple(effects))


def _beyond(model: Model, held: Held) -> Held:
    """Numbers at or beyond a limit that are not held, and the limit."""
    out = {}
    for place, effect in enumerate(model):
        for name in {*effect.limits, *_ranged(effect)}:
            value = effect.values[name]
            if name in effect.hold or (place, name) in held or value is None:
                continue
            limit = effect.limits.reached(name, value)
            if limit is None and name in _ranged(effect):
                declared = effect.parameter(name)
                limit = Limits({name: (declared.low, declared.high)}).reached(name, value)
            if limit is not None:
                out[place, name] = limit
    return out


def _ranged(effect: Effect) -> tuple[str, ...]:
    """Shapes of the random part that a fit may move: what is at the end of its range is no maximum, as at a limit."""
    return () if isinstance(effect, Deterministic) else effect.free_shapes


def _moved_in(effect: Effect) -> Effect:
    """With starting values within the limits, and nothing held at them yet."""
    if not effect.limits and not effect.at_limit:
        return effect
    values = {
        name: effect.limits.clipped(name, value)
        for name in effect.limits
        if (value := effect.values[name]) is not None
    }
    return effect.with_values(**values, at_limit=())


def _holding(model: Model, found: Model, held: Held) -> Model:
    """The model with numbers held at their limits.

    A known function of time is as it was found otherwise, and so is what is at the end of its own range: nothing was beyond
    it, and with one shape given a search for the others may end elsewhere.
    """
    effects = list(model.effects)
    for place, effect in enumerate(effects):
        values = {name: value for (at, name), value in held.items() if at == place}
        if values:
            # Amplitudes and phase are held together: those not at a limit need their values.
            asked = not isinstance(effect, Deterministic) and values.keys() & effect.limits
            base = effect if asked else found.effects[place]
            effects[place] = base.with_values(**values, at_limit=tuple(values))
    return Model(tuple(effects))

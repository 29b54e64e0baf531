"""Intervals of fitted numbers end at their limits; shapes of what is not detected have none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.parameters import Estimate

if TYPE_CHECKING:
    from allanite.effects import Effect

__all__ = ["with_ends"]


def with_ends(effect: Effect, values: dict[str, Any]) -> dict[str, Any]:
    """Numbers of an effect by name, with the intervals that they can have."""
    out = dict(values)
    for name, value in values.items():
        if not isinstance(value, Estimate) or value.interval is None:
            continue
        if not value.detected and _is_shape(effect, name):
            # Of a line that is not there no frequency is the right one, and none is a limit.
            out[name] = Estimate(value.value, None, None, value.unit, False, name)
        elif name in effect.limits:
            low, high = (effect.limits.clipped(name, end) for end in value.interval)
            out[name] = Estimate(
                value.value, value.std_error, (low, high), value.unit, value.detected, name
            )
    return out


def _is_shape(effect: Effect, name: str) -> bool:
    """Whether a number says where or when an effect is, and not how large."""
    declared = effect.parameter(name)
    return declared.role in ("shape", "time") or declared.unit in ("Hz", "s", "rad")

"""Clip intervals of estimates to the limits of parameters, and remove intervals of shapes of undetected effects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.parameters import Estimate

if TYPE_CHECKING:
    from allanite.effects import Effect


def with_admissible_intervals(effect: Effect, values: dict[str, Any]) -> dict[str, Any]:
    """Values of an effect by name with admissible intervals.

    Intervals are clipped to limits. Shapes of an effect that is not detected have no interval.
    """
    out = dict(values)
    for name, value in values.items():
        if not isinstance(value, Estimate) or value.interval is None:
            continue
        if not value.detected and _is_shape(effect, name):
            # The frequency of a line that does not exist has no true value.
            out[name] = Estimate(value.value, None, None, value.unit, False, name)
        elif name in effect.limits:
            low, high = (effect.limits.clipped(name, end) for end in value.interval)
            out[name] = Estimate(
                value.value, value.std_error, (low, high), value.unit, value.detected, name
            )
    return out


def _is_shape(effect: Effect, name: str) -> bool:
    """True if a parameter describes place, time or form of an effect instead of its size."""
    declared = effect.parameter(name)
    return declared.role in ("shape", "time") or declared.unit in ("Hz", "s", "rad")

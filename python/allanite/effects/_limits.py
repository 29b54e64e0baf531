"""Limits of the parameters of an effect in a fit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from allanite.effects._declared import Parameter

#: Maximum distance between a value and its limit, relative to the limit, at which the value counts as at the limit. It
#: covers the rounding of logarithms.
LIMIT_TOLERANCE = 1e-9


class Limits(Mapping[str, tuple[float, float]]):
    """Immutable mapping from parameter names to (lowest, highest) value; an open end is ±∞.

    Examples
    --------
    >>> dict(al.RateRandomWalk(limits={"K": (None, 0.1)}).limits)
    {'K': (-inf, 0.1)}
    """

    __slots__ = ("_ends",)

    def __init__(self, ends: Mapping[str, tuple[float, float]]) -> None:
        self._ends = dict(sorted(ends.items()))

    def __getitem__(self, name: str) -> tuple[float, float]:
        return self._ends[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._ends)

    def __len__(self) -> int:
        return len(self._ends)

    def __hash__(self) -> int:
        return hash(tuple(self._ends.items())) if self._ends else 0

    def __repr__(self) -> str:
        return repr(self._ends)

    def reached(self, name: str, value: float) -> float | None:
        """Limit of parameter `name` that `value` has reached (to a relative 1e-9) or exceeded, or None."""
        low, high = self._ends.get(name, (-math.inf, math.inf))
        if value <= low + LIMIT_TOLERANCE * abs(low):
            return low
        return high if value >= high - LIMIT_TOLERANCE * abs(high) else None

    def clipped(self, name: str, value: float) -> float:
        """`value` clipped to the limits of parameter `name`; unchanged without limits."""
        low, high = self._ends.get(name, (-math.inf, math.inf))
        return min(max(value, low), high)

    def shown(self, name: str) -> str:
        """Text of the limits of parameter `name` as in model strings, ``[10,100]``; empty without limits."""
        if name not in self._ends:
            return ""
        low, high = (f"{end:.6g}" if math.isfinite(end) else "" for end in self._ends[name])
        return f"[{low},{high}]"

    def to_dict(self) -> dict[str, list[float | None]]:
        """Dict (JSON form) from parameter names to [lower, upper]; None for an open end."""
        return {
            name: [end if math.isfinite(end) else None for end in ends]
            for name, ends in self._ends.items()
        }


#: Empty limits.
NO_LIMITS = Limits({})


def limitable(parameter: Parameter) -> bool:
    """True if a parameter can have limits: it is fitted and is not an angle or a text."""
    return parameter.role in {"coefficient", "shape"} and parameter.unit not in {"rad", "text"}


def limits_of(kind: str, parameters: Sequence[Parameter], given: Any) -> Limits:
    """Checked `Limits` from user input: a mapping of parameter names to pairs (lower, upper), None for no limit.

    A limit at or beyond an end of the parameter's own range becomes −∞ or ∞. Pairs without a finite limit are omitted.
    Raises `InputError` for anything but numbers and None, for a lower limit that is not below the upper one, for limits
    entirely outside the range, and for a parameter that cannot have limits.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{kind}: limits must be (low, high) by name, found {str(given)[:40]!r}")
    declared = {p.name: p for p in parameters}
    out = {}
    for name, pair in given.items():
        parameter = declared.get(name)
        if parameter is None or not limitable(parameter):
            raise InputError(f"{kind}: {str(name)[:40]} cannot have limits")
        low, high = _checked_ends(kind, name, pair)
        if low > high:
            raise InputError(
                f"{kind}: the lower limit of {name}, {low:g}, is above the upper one, {high:g}"
            )
        if low == high:
            raise InputError(f"{kind}: both limits of {name} are {low:g}; hold it there instead")
        if high <= parameter.low or low >= parameter.high:
            raise InputError(
                f"{kind}: the limits of {name}, {low:g} … {high:g}, are outside its range"
                f" {parameter.low:g} … {parameter.high:g}"
            )
        low = low if low > parameter.low else -math.inf
        high = high if high < parameter.high else math.inf
        if (low, high) != (-math.inf, math.inf):
            out[name] = (low, high)
    return Limits(out) if out else NO_LIMITS


def _checked_ends(kind: str, name: str, pair: Any) -> tuple[float, float]:
    """Pair (lower, upper) limit as floats, with ∓∞ for None; InputError if `pair` is not two numbers or None."""
    try:
        low, high = pair
        ends = (-math.inf if low is None else float(low), math.inf if high is None else float(high))
    except (TypeError, ValueError, OverflowError):
        ends = (math.nan, math.nan)
    if isinstance(pair, str) or any(math.isnan(end) for end in ends):
        raise InputError(
            f"{kind}: the limits of {name} must be two numbers, found {str(pair)[:40]!r}"
        )
    return ends

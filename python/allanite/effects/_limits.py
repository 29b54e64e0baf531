"""Limits on the numbers of an effect: what a fit may find for them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from allanite.effects._declared import Parameter

__all__ = ["NONE", "Limits", "limitable", "limits_of"]

#: A number is at its limit if it is this near to it, relative: shapes are searched in their logarithms.
NEAR = 1e-9


class Limits(Mapping[str, tuple[float, float]]):
    """(lowest, highest) value by the name of a number, in its own unit; an open end is ±∞. Does not change.

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
        """The limit of a number that a value is at or beyond; None where it is between them."""
        low, high = self._ends.get(name, (-math.inf, math.inf))
        if value <= low + NEAR * abs(low):
            return low
        return high if value >= high - NEAR * abs(high) else None

    def clipped(self, name: str, value: float) -> float:
        """The nearest value of a number within its limits."""
        low, high = self._ends.get(name, (-math.inf, math.inf))
        return min(max(value, low), high)

    def shown(self, name: str) -> str:
        """As a model string has them, ``[10,100]``; empty where there are none."""
        if name not in self._ends:
            return ""
        low, high = (f"{end:.6g}" if math.isfinite(end) else "" for end in self._ends[name])
        return f"[{low},{high}]"

    def to_dict(self) -> dict[str, list[float | None]]:
        """JSON form: null for an open end."""
        return {
            name: [end if math.isfinite(end) else None for end in ends]
            for name, ends in self._ends.items()
        }


#: No limits at all.
NONE = Limits({})


def limitable(parameter: Parameter) -> bool:
    """Whether a number can have limits: a fit moves it, and it is no angle, which comes round."""
    return parameter.role in {"coefficient", "shape"} and parameter.unit not in {"rad", "text"}


def limits_of(kind: str, parameters: Sequence[Parameter], given: Any) -> Limits:
    """What was given as limits, checked; ends that limit nothing are left out.

    Raises
    ------
    InputError
        No pair of numbers or None, a number that has no limits, or limits that contradict each other.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{kind}: limits must be (low, high) by name, found {str(given)[:40]!r}")
    declared = {p.name: p for p in parameters}
    out = {}
    for name, pair in given.items():
        parameter = declared.get(name)
        if parameter is None or not limitable(parameter):
            raise InputError(f"{kind}: {str(name)[:40]} cannot have limits")
        low, high = _ends(kind, name, pair)
        if low > high:
            raise InputError(
                f"{kind}: the lower limit of {name}, {low:g}, is above the upper one, {high:g}"
            )
        if low == high:
            raise InputError(f"{kind}: both limits of {name} are {low:g}: hold it there instead")
        if high <= parameter.low or low >= parameter.high:
            raise InputError(
                f"{kind}: the limits of {name}, {low:g} … {high:g}, leave nothing of its range"
                f" {parameter.low:g} … {parameter.high:g}"
            )
        low = low if low > parameter.low else -math.inf
        high = high if high < parameter.high else math.inf
        if (low, high) != (-math.inf, math.inf):
            out[name] = (low, high)
    return Limits(out) if out else NONE


def _ends(kind: str, name: str, pair: Any) -> tuple[float, float]:
    """The two ends of a pair of numbers, of which None is open."""
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

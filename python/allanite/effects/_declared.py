"""What an effect declares: its parameters, how its line is read, how a check looks for it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from inspect import get_annotations
from typing import Any

import numpy as np

from allanite.common.errors import InputError
from allanite.common.validation import MAX_NUMBER

__all__ = ["SCREENS", "Parameter", "StraightLine", "has_several", "names_of"]

#: How a check looks for an effect.
SCREENS = {
    "spectral": "every point of its shape grid moves the mean spectrum in its own way",
    "slow": "a matched filter on the lowest ordinates at every point of its shape grid",
    "line": "lines of any frequency, with their harmonics",
    "drifting line": "bands of the spectrum turned back at every rate of drift, where a line or a resonance was found",
    "passing line": "stretches of time in bands of the spectrum, where a line or a resonance was found",
    "level": "the white level over time",
    "band level": "the level of each octave over time",
    "stretch": "stretches of time that are louder in some band",
    "outlier": "single samples beyond what the noise allows",
    "moving band": "the places of a band that the model has, in sections of the record",
    "two levels": "the law of the samples where another process has the same spectrum",
    "none": "not at all: it is fitted where a model names it",
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect.

    Attributes
    ----------
    name : str
        JSON name, as in constructors.
    unit : float or str
        A float p means U·s^p for samples in U; a string is the unit itself (``s``, ``Hz``, ``1``, ``rad``).
    low, high : float
        Bounds, both included.
    role : str
        ``coefficient`` (the model is linear in it or its square), ``shape`` (found by scan and polish), ``choice``
        (one of a few), ``time`` (found by the time view) or ``derived`` (reported only).
    aliases : tuple of str
        Short spellings in model strings.
    symbol : str
        What a legend prints for it; its name where empty.
    optional : bool
        Whether simulation and planning do without a value (a lag that is not there, a phase).
    sheet : mapping of str to str
        Unit in which data sheets print it, by kind of sensor (``units.Unit.kind``).
    figures : mapping of str to tuple of str
        What data sheets call it, each name with its other spellings.
    """

    name: str
    unit: float | str
    description: str
    role: str = "coefficient"
    low: float = 0.0
    high: float = np.inf
    aliases: tuple[str, ...] = ()
    symbol: str = ""
    optional: bool = False
    sheet: Mapping[str, str] = field(default_factory=dict)
    figures: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def accepted(self, value: Any, several: bool) -> Any:
        """A given value as a number within the bounds, `several` as a tuple of finite numbers, text as it is.

        Raises
        ------
        InputError
            Another type, or a number out of the bounds; it begins with the name of the parameter.
        """
        if several:
            low, high = -MAX_NUMBER, MAX_NUMBER
            given = [value] if isinstance(value, (int, float)) else value
            if isinstance(given, (list, tuple)):
                return tuple(self._number(one, low, high) for one in given)
            raise InputError(f"{self.name} = {_shown(value)} is no list of numbers")
        if self.unit == "text":
            if isinstance(value, str):
                return value
            raise InputError(f"{self.name} = {_shown(value)} is no text")
        return self._number(value, *self.bounds)

    def _number(self, value: Any, low: float, high: float) -> float:
        try:
            # A text is no number, though float() reads it.
            number = math.nan if isinstance(value, (str, bytes)) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if math.isnan(number):
            raise InputError(f"{self.name} = {_shown(value)} is not a number")
        if not low <= number <= high:
            raise InputError(
                f"{self.name} = {_shown(value)} is out of its range {low:g} … {high:g}"
            )
        return number

    @property
    def bounds(self) -> tuple[float, float]:
        """The bounds, finite."""
        return max(self.low, -MAX_NUMBER), min(self.high, MAX_NUMBER)


def has_several(cls: type, name: str) -> bool:
    """Return whether the parameter `name` of an effect is a tuple of numbers."""
    return any("tuple" in str(get_annotations(base).get(name)) for base in cls.__mro__)


def _shown(value: Any) -> str:
    """The first letters of a value."""
    return repr(value)[:60]


@dataclass(frozen=True, slots=True)
class StraightLine:
    """How IEEE 952-1997 reads a coefficient off the Allan deviation.

    Attributes
    ----------
    name : str
        Of the coefficient: Q, N, B, K or R.
    slope : float
        On log-log paper.
    read_at : float or None
        τ at which the line is read, s; None for a plateau.
    level : float
        The line of coefficient 1 there.
    scatter : str
        Primitive term (see `effects.terms`) whose scatter the curve has on this slope.
    """

    name: str
    slope: float
    read_at: float | None
    level: float
    scatter: str


_NAMES: dict[type, frozenset[str]] = {}


def names_of(cls: Any) -> frozenset[str]:
    """Names of what the objects of a dataclass are made of; asked for at every copy."""
    if cls not in _NAMES:
        _NAMES[cls] = frozenset(f.name for f in fields(cls))
    return _NAMES[cls]

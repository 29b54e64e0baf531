"""Declarations of effects: parameters, straight lines on the Allan curve, and methods of search (screens)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from inspect import get_annotations
from typing import Any

import numpy as np

from allanite.common.arrays import Array as Array
from allanite.common.errors import InputError
from allanite.common.validation import MAX_NUMBER

#: Logged columns of a recording by name, shape (n,) each.
Columns = Mapping[str, Array]

#: Methods by which a check searches for an effect, with their descriptions.
SEARCH_METHODS = {
    "spectral": "fit of the mean spectrum at every point of its shape grid",
    "slow": "matched filter on the lowest ordinates at every point of its shape grid",
    "line": "search of lines at all frequencies, with their harmonics",
    "drifting line": "search at all drift rates in bands in which a line or a resonance was found",
    "passing line": "search over time intervals in bands in which a line or a resonance was found",
    "level": "white-noise level over time",
    "band level": "level of each octave over time",
    "stretch": "time segments that are louder in some band",
    "outlier": "single samples larger than the noise allows",
    "moving band": "frequency over time of a band of the model",
    "two levels": "distribution of the samples, if another process has the same spectrum",
    "none": "no search: the effect is fitted only if a model names it",
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """Declaration of one parameter of an effect.

    Attributes
    ----------
    name : str
        JSON name, as in constructors.
    unit : float or str
        A float p means U·s^p for samples in U; a string is the unit itself (``s``, ``Hz``, ``1``, ``rad``).
    description : str
        Meaning of the parameter, for docstrings and documentation.
    role : str
        ``coefficient`` (the model is linear in it or its square), ``shape`` (found by grid search and optimization),
        ``choice`` (one of a few), ``time`` (found over time) or ``derived`` (only reported).
    low, high : float
        Bounds, both included.
    aliases : tuple of str
        Other spellings in model strings.
    symbol : str
        Symbol in legends; if empty, the name.
    optional : bool
        True if simulation and planning work without a value (no lag, any phase).
    sheet : mapping of str to str
        Unit in which data sheets print the parameter, by kind of sensor (``units.Unit.kind``).
    figures : mapping of str to tuple of str
        Names that data sheets use, each with its other spellings.
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
        """Given `value`, checked and converted: float within the bounds, text, or, if `several`, tuple of floats.

        If `several`, a single number counts as a list, and only `MAX_NUMBER` bounds the numbers. Raises `InputError`
        for another type or a number out of the bounds. The message starts with the parameter's name.
        """
        if several:
            low, high = -MAX_NUMBER, MAX_NUMBER
            given = [value] if isinstance(value, (int, float)) else value
            if isinstance(given, (list, tuple)):
                return tuple(self._number(one, low, high) for one in given)
            raise InputError(f"{self.name} = {_value_text(value)} is not a list of numbers")
        if self.unit == "text":
            if isinstance(value, str):
                return value
            raise InputError(f"{self.name} = {_value_text(value)} is not a text")
        return self._number(value, *self.bounds)

    def _number(self, value: Any, low: float, high: float) -> float:
        """Given `value` as a float; `InputError` if it is not a number from `low` to `high`.

        Texts and NaN are rejected; infinity is accepted if it is within the bounds.
        """
        try:
            # Texts are rejected, although float() would parse them.
            number = math.nan if isinstance(value, (str, bytes)) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if math.isnan(number):
            raise InputError(f"{self.name} = {_value_text(value)} is not a number")
        if not low <= number <= high:
            raise InputError(
                f"{self.name} = {_value_text(value)} is out of its range {low:g} … {high:g}"
            )
        return number

    @property
    def bounds(self) -> tuple[float, float]:
        """Pair (lowest, highest) admissible value; infinite bounds become ∓`MAX_NUMBER`."""
        return max(self.low, -MAX_NUMBER), min(self.high, MAX_NUMBER)


def texts_for_clocks(**texts: str) -> Mapping[str, Mapping[str, str]]:
    """Class attribute `texts` of an effect with other ``physics``, ``looks_like`` or ``check_by`` for clocks.

    Omitted texts are as for other sensors.
    """
    return {"fractional frequency": texts}


def has_several(cls: type, name: str) -> bool:
    """True if the parameter `name` of an effect class is annotated as a tuple of numbers."""
    return any("tuple" in str(_annotations_of(base).get(name)) for base in cls.__mro__)


@lru_cache(maxsize=256)
def _annotations_of(cls: type) -> Mapping[str, Any]:
    """Mapping from names to annotations of a class without its base classes; cached for speed."""
    return get_annotations(cls)


def _value_text(value: Any) -> str:
    """`repr` of a value, cut to 60 characters, for messages."""
    return repr(value)[:60]


#: Name of the column that an effect follows.
COLUMN = Parameter("column", "text", "name of the column", "choice")
#: Cutoff of a filter.
CUTOFF = Parameter(
    "cutoff", "Hz", "−3 dB frequency", "shape", low=1e-12, aliases=("f", "fc"), symbol="f"
)


def frequency_parameter(description: str) -> Parameter:
    """`Parameter` named ``frequency``: the fitted frequency of a line, a band or a gap, Hz."""
    return Parameter(
        "frequency", "Hz", description, "shape", low=1e-12, aliases=("f", "f0"), symbol="f"
    )


def lag_parameter(name: str, description: str) -> Parameter:
    """`Parameter` with this `name`: a fitted time constant of a first-order low-pass on a column, s, with the symbol T."""
    return Parameter(name, "s", description, "shape", low=1e-12, aliases=("T",), symbol="T")


def log_grid(low: float, high: float, per_decade: int = 8, at_least: int = 4) -> Array:
    """Logarithmically spaced values from `low` to `high`, both included, about `per_decade` in each decade.

    There are at least `at_least` values.
    """
    return np.geomspace(low, high, max(at_least, int(per_decade * np.log10(high / low))))


@dataclass(frozen=True, slots=True)
class StraightLine:
    """Straight line from which IEEE 952-1997 reads a coefficient `name` (Q, N, B, K or R) of the Allan deviation.

    `level` is the value of the line at τ = `read_at` (s; None for a plateau) for coefficient 1. `slope` is in log-log
    scale. `scatter` is the primitive term with which the scatter of the curve on this slope is computed.
    """

    name: str
    slope: float
    read_at: float | None
    level: float
    scatter: str


#: Cache of `names_of`: field names by dataclass.
_NAMES: dict[type, frozenset[str]] = {}


def names_of(cls: Any) -> frozenset[str]:
    """Frozenset of the field names of a dataclass; cached, because every copy of an effect needs them."""
    if cls not in _NAMES:
        _NAMES[cls] = frozenset(f.name for f in fields(cls))
    return _NAMES[cls]

"""Model strings: ``N+B+K``, ``Q+GM(T=30)+SIN(f=7.3!)``, ``N(N=[,0.2])+GM(T=30[10,100])``, ``N(N=0.3 deg/sqrt(h))``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.units import coefficient_unit, conversion
from allanite.effects._declared import has_several
from allanite.effects._limits import NO_LIMITS
from allanite.effects.model import Model
from allanite.effects.registry import CATALOG, find

if TYPE_CHECKING:
    from allanite.effects._base import Effect, Parameter

#: SI units of samples, in the order in which they are tried for model strings with units.
SI_UNITS = ("rad/s", "m/s^2", "1")

#: Patterns of a name, of a decimal number, and of a word such as the name of a column.
_NAME = r"[^\W\d]\w*"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_WORD = r"[\w.\-/°]+"


class _Reader:
    """Tokenizer of a model string; its methods read at the position `at` and advance it ("consume")."""

    def __init__(self, text: str, unit: str | None = None) -> None:
        self.text, self.at = text, 0
        #: Unit of the samples: as given, or from the first value with a unit.
        self.unit = unit
        self.has_units = False
        #: Name and position of the first coefficient whose value has no unit.
        self.bare: tuple[str, int] | None = None

    def error_at(self, what: str, at: int | None = None) -> InputError:
        """New InputError (not raised) that points at position `at` of the string, by default the present one."""
        place = self.at if at is None else at
        return InputError(
            f"model {self.text!r}: {what} at character {place + 1} "
            f"(…{self.text[max(0, place - 8) : place]}»{self.text[place : place + 8]})"
        )

    def take(self, pattern: str) -> str | None:
        """Next text after white space, consumed, if it matches a regular expression; otherwise None."""
        match = re.compile(rf"\s*({pattern})?").match(self.text, self.at)
        assert match is not None
        self.at = match.end()
        return match[1]

    def require(self, pattern: str, what: str) -> str:
        """Next text after white space, consumed; InputError "expected `what`" if it does not match a regular expression."""
        found = self.take(pattern)
        if found is None:
            raise self.error_at(f"expected {what}")
        return found

    def is_next(self, sign: str) -> bool:
        """True if the next text is `sign`; only white space is consumed."""
        return self.take(f"(?={re.escape(sign)})") is not None

    def take_limits(self) -> tuple[float | None, float | None] | None:
        """Pair (low, high) from limits ``[low,high]``, consumed, with None for a missing end; None without limits."""
        if self.take(r"\[") is None:
            return None
        low = None if self.is_next(",") else self.take_number()
        self.require(",", ", between two limits")
        high = None if self.is_next("]") else self.take_number()
        self.require("]", "]")
        return low, high

    def take_number(self) -> float:
        """Next number as a float, consumed; InputError without a number."""
        return float(self.require(_NUMBER, "a number"))

    def take_unit(self) -> str:
        """Text up to the next ``,`` ``)`` ``!`` or ``[`` outside parentheses, consumed: the unit of a value, or empty."""
        start, depth = self.at, 0
        while self.at < len(self.text):
            letter = self.text[self.at]
            if depth == 0 and letter in ",)![":
                break
            depth += (letter == "(") - (letter == ")")
            self.at += 1
        return self.text[start : self.at].strip()

    def take_factor(self, parameter: Parameter, place: int) -> float:
        """Factor from the unit at the present position, which is consumed, to the unit of `parameter`; 1 without a unit.

        A coefficient with a unit sets `unit`, the unit of the samples, and `has_units`. One without a unit sets `bare`
        to its name and position `place`, unless `bare` is set. Raises `InputError` for a unit that does not fit.
        """
        start = self.at
        own = self.take_unit()
        if not own:
            if isinstance(parameter.unit, float) and self.bare is None:
                self.bare = (parameter.name, place)
            return 1.0
        if isinstance(parameter.unit, str):
            if parameter.unit == "text":
                raise self.error_at("expected , or )", start)
            try:
                return conversion(own, parameter.unit)
            except InputError as error:
                raise self.error_at(f"{parameter.name} in {own}: {error}", place) from None
        self.has_units = True
        problem: InputError | None = None
        for sample_unit in SI_UNITS if self.unit is None else (self.unit,):
            try:
                factor = conversion(own, coefficient_unit(sample_unit, parameter.unit))
            except InputError as error:
                problem = problem or error
                continue
            self.unit = sample_unit
            return factor
        raise self.error_at(f"{parameter.name} in {own}: {problem}", place)


def parse_string(text: str) -> Model:
    """`Model` of a model string whose values have no units; raises `InputError` that points at the wrong character."""
    model, own = parse_with_units(text)
    if own is not None:
        raise InputError(
            f"model {text!r} has values with units, so the unit of the samples is needed",
            missing="unit",
            remedy=": give {unit}",
        )
    return model


def parse_with_units(text: str, unit: str | None = None) -> tuple[Model, str | None]:
    """Model of a model string, and the unit of the samples to which its coefficients refer, or None if unknown.

    Values may have units: ``N(N=0.3 deg/sqrt(h))+GM(T=10 min)``. Without a `unit` of the samples, such coefficients are
    converted to the SI unit of their kind of sensor. Raises `InputError` as `parse_string`, also for units of two kinds
    of sensor, or if only some coefficients have a unit.
    """
    reader = _Reader(text, unit)
    effects: list[Effect] = []
    while True:
        effects.append(_take_effect(reader))
        if not reader.require(r"\+|\Z", "+ or the end"):
            break
    if reader.has_units and reader.bare is not None and unit is None:
        name, place = reader.bare
        raise reader.error_at(
            f"{name} has no unit, but other values have; give each value a unit", place
        )
    return Model(tuple(effects)), reader.unit


def _take_effect(reader: _Reader) -> Effect:
    """Next `Effect` of a model string, consumed; InputError for unknown names or invalid syntax."""
    name = reader.require(_NAME, "the name of an effect")
    start = reader.at - len(name)
    cls = find(name)
    if cls is None and "temp" in name.lower():
        raise reader.error_at(
            f"{name!r} is a column, not an effect; write COV(column={name})", start
        )
    if cls is None:
        known = " ".join(e.short for e in CATALOG)
        raise reader.error_at(f"unknown effect {name!r} (known: {known})", start)
    values: dict[str, Any] = {}
    held: list[str] = []
    limits: dict[str, tuple[float | None, float | None]] = {}
    if reader.take(r"\("):
        while True:
            key = reader.require(_NAME, "a parameter")
            place = reader.at - len(key)
            parameter = next(
                (p for p in cls.parameters if key in (p.name, *p.aliases) and p.role != "derived"),
                None,
            )
            if parameter is None:
                known = " ".join(p.name for p in cls.parameters if p.role != "derived")
                raise reader.error_at(
                    f"{cls.kind} has no parameter {key!r} (it has: {known})", place
                )
            reader.require("=", "=")
            several = has_several(cls, parameter.name)
            if several and reader.is_next("["):
                raise reader.error_at(
                    f"{parameter.name} of {cls.kind} is one number in a model string (lists are possible in Python and"
                    " model files); found a list",
                    place,
                )
            factor: float | None = None
            if not reader.is_next("["):
                if parameter.unit == "text" and not several:
                    values[parameter.name] = reader.require(_WORD, "a value")
                else:
                    number = reader.take_number()
                    factor = reader.take_factor(parameter, place)
                    values[parameter.name] = (number * factor,) if several else number * factor
                if reader.take("!"):
                    held.append(parameter.name)
            ends = reader.take_limits()
            if ends is not None:
                # Limits have the unit of the value; without a value, the unit follows the limits.
                factor = reader.take_factor(parameter, place) if factor is None else factor
                low, high = ends
                limits[parameter.name] = (
                    None if low is None else low * factor,
                    None if high is None else high * factor,
                )
            if reader.require("[,)]", ", or )") == ")":
                break
    return cls(**values, hold=tuple(held), limits=limits or NO_LIMITS)

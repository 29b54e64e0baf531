"""Model strings: ``N+B+K``, ``Q+GM(T=30)+SIN(f=7.3!)``, ``N(N=[,0.2])+GM(T=30[10,100])``, ``N(N=0.3 deg/sqrt(h))``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.units import coefficient_unit, conversion
from allanite.effects._declared import has_several
from allanite.effects._limits import NO_LIMITS
from allanite.effects.model import Model
from allanite.effects.registry import CATALOGUE, find

if TYPE_CHECKING:
    from allanite.effects._base import Effect, Parameter

#: SI units of samples, in the order in which they are tried for model strings with units.
SI_UNITS = ("rad/s", "m/s^2", "1")

_TOKEN = re.compile(r"\s*(?:(?P<name>[^\W\d]\w*)|(?P<sign>[+(),=!]))")
_NUMBER = re.compile(r"\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_WORD = re.compile(r"\s*(?P<word>[\w.\-/°]+)")


class _Reader:
    """Tokenizer of a model string with a reading position."""

    def __init__(self, text: str, unit: str | None = None) -> None:
        self.text, self.at = text, 0
        #: Unit of the samples: as given, or from the first value with a unit.
        self.unit = unit
        self.has_units = False
        #: Name and position of the first coefficient whose value has no unit.
        self.bare: tuple[str, int] | None = None

    def fail(self, what: str, at: int | None = None) -> InputError:
        """Error that points at a position of the string, by default the present one."""
        place = self.at if at is None else at
        return InputError(
            f"model {self.text!r}: {what} at character {place + 1} "
            f"(…{self.text[max(0, place - 8) : place]}»{self.text[place : place + 8]})"
        )

    def skip(self) -> None:
        """Skip white space."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1

    def sign(self, signs: str) -> str | None:
        """The next character, consumed if it is one of `signs`; otherwise None."""
        self.skip()
        if self.at < len(self.text) and self.text[self.at] in signs:
            self.at += 1
            return self.text[self.at - 1]
        return None

    def name(self, what: str) -> tuple[str, int]:
        """Pair: next name, consumed, and its position."""
        self.skip()
        match = _TOKEN.match(self.text, self.at)
        if match is None or match["name"] is None:
            raise self.fail(f"expected {what}")
        start = self.at
        self.at = match.end()
        return match["name"], start

    def follows(self, sign: str) -> bool:
        """True if the next character is `sign`; does not consume it."""
        self.skip()
        return self.text.startswith(sign, self.at)

    def limits(self) -> tuple[float | None, float | None] | None:
        """Limits ``[low,high]``, consumed; an end may be missing. None without limits."""
        if self.sign("[") is None:
            return None
        low = None if self.follows(",") else self.number()
        if self.sign(",") is None:
            raise self.fail("expected , between two limits")
        high = None if self.follows("]") else self.number()
        if self.sign("]") is None:
            raise self.fail("expected ]")
        return low, high

    def number(self) -> float:
        """The next number, consumed."""
        return float(self.matched(_NUMBER, "a number"))

    def value(self, *, text: bool) -> float | str:
        """The next number, or word if `text`, consumed."""
        return self.matched(_WORD, "a value") if text else self.number()

    def unit_text(self) -> str:
        """Unit of a value, consumed: the text up to the next ``,`` ``)`` ``!`` or ``[`` outside parentheses."""
        self.skip()
        start, depth = self.at, 0
        while self.at < len(self.text):
            letter = self.text[self.at]
            if depth == 0 and letter in ",)![":
                break
            depth += (letter == "(") - (letter == ")")
            self.at += 1
        return self.text[start : self.at].strip()

    def factor(self, parameter: Parameter, place: int) -> float:
        """Factor from the unit that follows to the parameter's own unit; 1 if no unit follows."""
        start = self.at
        own = self.unit_text()
        is_coefficient = not isinstance(parameter.unit, str)
        if not own:
            if is_coefficient and self.bare is None:
                self.bare = (parameter.name, place)
            return 1.0
        if isinstance(parameter.unit, str):
            if parameter.unit == "text":
                raise self.fail("expected , or )", start)
            try:
                return conversion(own, parameter.unit)
            except InputError as error:
                raise self.fail(f"{parameter.name} in {own}: {error}", place) from None
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
        raise self.fail(f"{parameter.name} in {own}: {problem}", place)

    def matched(self, pattern: re.Pattern[str], what: str) -> str:
        """Text of the next match of a pattern, consumed; `what` names it in the message if it is missing."""
        match = pattern.match(self.text, self.at)
        if match is None:
            raise self.fail(f"expected {what}")
        self.at = match.end()
        return match[1]


def parse_string(text: str) -> Model:
    """The model of a model string whose values have no units.

    Raises
    ------
    InputError
        Unknown effect or parameter, or invalid syntax; the message points at the character. Also for values with
        units.
    """
    model, own = parse_with_units(text)
    if own is not None:
        raise InputError(
            f"model {text!r} has values with units, so the unit of the samples is needed",
            missing="unit",
            remedy=": give {unit}",
        )
    return model


def parse_with_units(text: str, unit: str | None = None) -> tuple[Model, str | None]:
    """The model of a model string, and the unit of the samples to which its coefficients refer.

    Parameters
    ----------
    text : str
        A model string. Values may have units: ``N(N=0.3 deg/sqrt(h))+GM(T=10 min)``.
    unit : str, optional
        Unit of the samples. Without it, coefficients with units are converted to the SI unit of their kind of sensor.

    Returns
    -------
    model : Model
    unit : str or None
        `unit`, or the SI unit (``rad/s``, ``m/s^2``, ``1``); None if neither is known.

    Raises
    ------
    InputError
        See `parse_string`; also for units of two kinds of sensor, or if only some coefficients have a unit.
    """
    reader = _Reader(text, unit)
    effects: list[Effect] = []
    while True:
        effects.append(_effect(reader))
        reader.skip()
        if reader.at == len(text):
            break
        if reader.sign("+") is None:
            raise reader.fail("expected + or the end")
    if reader.has_units and reader.bare is not None and unit is None:
        name, place = reader.bare
        raise reader.fail(
            f"{name} has no unit, but other values have; give each value a unit", place
        )
    return Model(tuple(effects)), reader.unit


def _effect(reader: _Reader) -> Effect:
    """The next effect of a model string, consumed."""
    name, start = reader.name("the name of an effect")
    cls = find(name)
    if cls is None and "temp" in name.lower():
        raise reader.fail(f"{name!r} is a column, not an effect; write COV(column={name})", start)
    if cls is None:
        known = " ".join(e.short for e in CATALOGUE)
        raise reader.fail(f"unknown effect {name!r} (known: {known})", start)
    values: dict[str, Any] = {}
    held: list[str] = []
    limits: dict[str, tuple[float | None, float | None]] = {}
    if reader.sign("("):
        while True:
            key, place = reader.name("a parameter")
            parameter = next(
                (p for p in cls.parameters if key in (p.name, *p.aliases) and p.role != "derived"),
                None,
            )
            if parameter is None:
                known = " ".join(p.name for p in cls.parameters if p.role != "derived")
                raise reader.fail(f"{cls.kind} has no parameter {key!r} (it has: {known})", place)
            if reader.sign("=") is None:
                raise reader.fail("expected =")
            several = has_several(cls, parameter.name)
            if several and reader.follows("["):
                number = f"{parameter.name} of {cls.kind} is one number in a model string"
                raise reader.fail(
                    f"{number} (lists are possible in Python and model files); found a list", place
                )
            factor: float | None = None
            if not reader.follows("["):
                value = reader.value(text=parameter.unit == "text" and not several)
                if isinstance(value, float):
                    factor = reader.factor(parameter, place)
                    value *= factor
                values[parameter.name] = (value,) if several else value
                if reader.sign("!"):
                    held.append(parameter.name)
            ends = reader.limits()
            if ends is not None:
                # Limits have the unit of the value; without a value, the unit follows the limits.
                factor = reader.factor(parameter, place) if factor is None else factor
                low, high = ends
                limits[parameter.name] = (
                    None if low is None else low * factor,
                    None if high is None else high * factor,
                )
            sign = reader.sign(",)")
            if sign is None:
                raise reader.fail("expected , or )")
            if sign == ")":
                break
    return cls(**values, hold=tuple(held), limits=limits or NO_LIMITS)

"""Model strings: ``N+B+K``, ``Q+GM(T=30)+SIN(f=7.3!)``, ``N(N=[,0.2])+GM(T=30[10,100])``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.effects._limits import NONE
from allanite.effects.model import Model
from allanite.effects.registry import CATALOGUE, find

if TYPE_CHECKING:
    from allanite.effects._base import Effect

__all__ = ["parse_string"]

_TOKEN = re.compile(r"\s*(?:(?P<name>[^\W\d]\w*)|(?P<sign>[+(),=!]))")
_NUMBER = re.compile(r"\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_WORD = re.compile(r"\s*(?P<word>[\w.\-/°]+)")


class _Reader:
    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def fail(self, what: str, at: int | None = None) -> InputError:
        place = self.at if at is None else at
        return InputError(
            f"model {self.text!r}: {what} at character {place + 1} "
            f"(…{self.text[max(0, place - 8) : place]}»{self.text[place : place + 8]})"
        )

    def skip(self) -> None:
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1

    def sign(self, signs: str) -> str | None:
        self.skip()
        if self.at < len(self.text) and self.text[self.at] in signs:
            self.at += 1
            return self.text[self.at - 1]
        return None

    def name(self, what: str) -> tuple[str, int]:
        self.skip()
        match = _TOKEN.match(self.text, self.at)
        if match is None or match["name"] is None:
            raise self.fail(f"expected {what}")
        start = self.at
        self.at = match.end()
        return match["name"], start

    def follows(self, sign: str) -> bool:
        self.skip()
        return self.text.startswith(sign, self.at)

    def limits(self) -> tuple[float | None, float | None] | None:
        """``[low,high]``, of which one may be left out; None where there are none."""
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
        return float(self.matched(_NUMBER, "a number"))

    def value(self, *, text: bool) -> float | str:
        return self.matched(_WORD, "a value") if text else self.number()

    def matched(self, pattern: re.Pattern[str], what: str) -> str:
        match = pattern.match(self.text, self.at)
        if match is None:
            raise self.fail(f"expected {what}")
        self.at = match.end()
        return match[1]


def parse_string(text: str) -> Model:
    """The model of a string.

    Raises
    ------
    InputError
        Unknown effect or parameter, or bad syntax; the message points at the character.
    """
    reader = _Reader(text)
    effects: list[Effect] = []
    while True:
        effects.append(_effect(reader))
        reader.skip()
        if reader.at == len(text):
            return Model(tuple(effects))
        if reader.sign("+") is None:
            raise reader.fail("expected + or the end")


def _effect(reader: _Reader) -> Effect:
    name, start = reader.name("the name of an effect")
    cls = find(name)
    if cls is None and "temp" in name.lower():
        raise reader.fail(f"{name!r} is a column, not an effect: write COV(column={name})", start)
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
            several = "tuple" in str(cls.__dataclass_fields__[parameter.name].type)
            if several and reader.follows("["):
                told = f"{parameter.name} of {cls.kind} may be a list in Python and in a model file"
                raise reader.fail(f"{told}, here it is one number", place)
            if not reader.follows("["):
                value = reader.value(text=parameter.unit == "text" and not several)
                values[parameter.name] = (value,) if several else value
                if reader.sign("!"):
                    held.append(parameter.name)
            ends = reader.limits()
            if ends is not None:
                limits[parameter.name] = ends
            sign = reader.sign(",)")
            if sign is None:
                raise reader.fail("expected , or )")
            if sign == ")":
                break
    return cls(**values, hold=tuple(held), limits=limits or NONE)

"""What `help` shows of an effect beyond its own words: its parameters as they are declared, and whose a method's are.

A declaration is the one place where names, units and ranges stand; a docstring written by hand would be a second one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from inspect import cleandoc
from types import FunctionType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.effects._declared import Parameter

__all__ = ["INTRODUCTION", "document", "unit_of"]

INTRODUCTION = "What is not given is fitted; U is the unit of the samples."
RAISES = """Raises
------
InputError
    A value that is no number or out of its range, a name to hold that no parameter has, or limits that leave nothing."""
HOLD = "hold : tuple of str\n    Names of parameters that a fit must not change."
LIMITS = "limits : mapping of str to tuple\n    (low, high) within which a fit stays, by name; None is an open end."
#: U·s^p as it is printed.
POWERS = {0.5: "U·s^½", -0.5: "U/s^½", 1.0: "U·s", -1.0: "U/s", 0.0: "U"}


def document(cls: type) -> None:
    """Complete the docstrings of an effect's class and of the methods with which it overrides others."""
    own = vars(cls)
    declared: Sequence[Parameter] = getattr(cls, "parameters", ())
    if own.get("__doc__") and declared and "Parameters\n" not in own["__doc__"]:
        cls.__doc__ = _inserted(own["__doc__"], _sections(declared), ("References\n", "Examples\n"))
    for name, member in own.items():
        method = member.__func__ if isinstance(member, classmethod) else member
        if name.startswith("_") or not isinstance(method, FunctionType) or not method.__doc__:
            continue
        first = next((c for c in reversed(cls.__mro__) if name in vars(c)), cls)
        if first is not cls and method.__code__.co_argcount > 1:
            text = f"Parameters as of `{first.__name__}.{name}`."
            if text not in method.__doc__:
                method.__doc__ = _inserted(method.__doc__, text, ("Raises\n",))


def unit_of(parameter: Parameter) -> str:
    """The unit of a parameter, as it is printed."""
    if isinstance(parameter.unit, str):
        return parameter.unit
    return POWERS.get(parameter.unit, f"U·s^{parameter.unit:g}")


def _inserted(doc: str, text: str, before: tuple[str, ...]) -> str:
    """A docstring with a text before the first of these sections, or at its end."""
    doc = cleandoc(doc)
    places = (doc.find(f"\n\n{section}-") for section in before)
    at = min((place for place in places if place >= 0), default=len(doc))
    return f"{doc[:at]}\n\n{text}{doc[at:]}"


def _sections(declared: Sequence[Parameter]) -> str:
    """Parameters and errors as numpydoc has them; what is derived is an attribute."""
    derived = [p for p in declared if p.role == "derived"]
    given = "\n".join([*(_entry(p) for p in declared if p not in derived), HOLD, LIMITS])
    parts = [INTRODUCTION, f"Parameters\n----------\n{given}"]
    if derived:
        parts.append("Attributes\n----------\n" + "\n".join(map(_entry, derived)))
    return "\n\n".join([*parts, RAISES])


def _entry(p: Parameter) -> str:
    unit = "" if p.unit == "text" else unit_of(p)
    said = {"choice": "a choice", "derived": "derived"}.get(p.role, "")
    kind = ", ".join(filter(None, (unit, said, "optional" if p.optional else "")))
    # Texts and lists have no range of their own, and what is derived is not given.
    bounded = (p.low, p.high) != (-math.inf, math.inf) and p.unit != "text" and p.role != "derived"
    limits = f"; range {p.low:g} … {p.high:g}".replace("inf", "∞") if bounded else ""
    # No capital: a choice is spelt as it is given.
    return f"{p.name} : {kind}\n    {p.description}{limits}."

"""Generate the parameter sections of the docstrings of effects from their declarations.

Declarations are the only place with names, units and ranges; hand-written docstrings would repeat them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from inspect import cleandoc
from types import FunctionType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.effects._declared import Parameter

#: First sentence of the parameter section.
INTRODUCTION = "Values that are not given are fitted; U is the unit of the samples."
#: Section on errors.
RAISES_SECTION = """Raises
------
InputError
    A value that is not a number or out of its range, a held name that is not a parameter, or limits outside a range."""
#: Entry of the parameter ``hold``.
HOLD_ENTRY = "hold : tuple of str\n    Names of parameters that a fit must not change."
#: Entry of the parameter ``limits``.
LIMITS_ENTRY = "limits : mapping of str to tuple\n    Limits (low, high) of a fit by name; None is an open end."
#: Printed units U·s^p by exponent p.
UNITS_BY_POWER = {0.5: "U·s^½", -0.5: "U/s^½", 1.0: "U·s", -1.0: "U/s", 0.0: "U"}


def document(cls: type) -> None:
    """Extend the docstrings of an effect class in place: parameter sections, and references to the overridden methods."""
    own = vars(cls)
    declared: Sequence[Parameter] = getattr(cls, "parameters", ())
    if own.get("__doc__") and declared and "Parameters\n" not in own["__doc__"]:
        cls.__doc__ = _with_text_inserted(
            own["__doc__"], _parameter_sections(declared), ("References\n", "Examples\n")
        )
    for name, member in own.items():
        method = member.__func__ if isinstance(member, classmethod) else member
        if name.startswith("_") or not isinstance(method, FunctionType) or not method.__doc__:
            continue
        first = next((c for c in reversed(cls.__mro__) if name in vars(c)), cls)
        if first is not cls and method.__code__.co_argcount > 1:
            text = f"For the parameters see `{first.__name__}.{name}`."
            if text not in method.__doc__:
                method.__doc__ = _with_text_inserted(method.__doc__, text, ("Raises\n",))


def unit_of(parameter: Parameter) -> str:
    """Printed unit of a parameter: its text, or for an exponent p the unit U·s^p, e.g. ``U·s^½``."""
    if isinstance(parameter.unit, str):
        return parameter.unit
    return UNITS_BY_POWER.get(parameter.unit, f"U·s^{parameter.unit:g}")


def _with_text_inserted(doc: str, text: str, before: tuple[str, ...]) -> str:
    """Docstring `doc` with `text` inserted before the first of the sections `before` that it has, otherwise appended."""
    doc = cleandoc(doc)
    places = (doc.find(f"\n\n{section}-") for section in before)
    at = min((place for place in places if place >= 0), default=len(doc))
    return f"{doc[:at]}\n\n{text}{doc[at:]}"


def _parameter_sections(declared: Sequence[Parameter]) -> str:
    """Text of the numpydoc sections on `declared` parameters, derived attributes (if any) and errors."""
    derived = [p for p in declared if p.role == "derived"]
    given = "\n".join(
        [*(_parameter_entry(p) for p in declared if p not in derived), HOLD_ENTRY, LIMITS_ENTRY]
    )
    parts = [INTRODUCTION, f"Parameters\n----------\n{given}"]
    if derived:
        parts.append("Attributes\n----------\n" + "\n".join(map(_parameter_entry, derived)))
    return "\n\n".join([*parts, RAISES_SECTION])


def _parameter_entry(p: Parameter) -> str:
    """Numpydoc entry ``name : unit, role, optional`` of a parameter, then its description and range."""
    unit = "" if p.unit == "text" else unit_of(p)
    role_text = {"choice": "a choice", "derived": "derived"}.get(p.role, "")
    kind = ", ".join(filter(None, (unit, role_text, "optional" if p.optional else "")))
    # Texts and derived parameters have no range.
    bounded = (p.low, p.high) != (-math.inf, math.inf) and p.unit != "text" and p.role != "derived"
    limits = f"; range {p.low:g} … {p.high:g}".replace("inf", "∞") if bounded else ""
    # Not capitalized, since choices are case-sensitive.
    return f"{p.name} : {kind}\n    {p.description}{limits}."

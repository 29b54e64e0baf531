"""Units in which tables print coefficients: those of data sheets, or those that were asked for."""

from __future__ import annotations

import math
import re
from contextvars import ContextVar
from types import MappingProxyType
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.units import FREQUENCY, conversion, normalised, parse_unit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.common.parameters import Estimate

__all__ = [
    "ASKED",
    "column_unit",
    "in_sheet",
    "in_table",
    "printed",
    "relative_unit",
    "sample_unit",
    "table_unit",
]

#: Units that were asked for, by kind of sensor: of samples, or of a coefficient.
ASKED: ContextVar[Mapping[str, str]] = ContextVar("asked", default=MappingProxyType({}))

_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_NAMES = r"(?:m?deg|arcsec|arcmin|m?rad|urad|rev)"


def table_unit(sample: str, power: float, sheet: Mapping[str, str]) -> str:
    """Unit of a coefficient in tables.

    Parameters
    ----------
    sample : str
        Unit U of the samples.
    power : float
        Power of seconds: the coefficient is in U·s^power.
    sheet : mapping of str to str
        What data sheets use, by kind of sensor.

    Returns
    -------
    str
        A data sheet's unit; where a unit was asked for, that if it is one of this coefficient, else a relative of U.
    """
    parsed = parse_unit(sample)
    asked = ASKED.get().get(parsed.kind)
    if asked is None:
        sample = "1" if parsed.kind == FREQUENCY else sample
        return sheet.get(parsed.kind) or relative_unit(sample, power)
    own = relative_unit(sample, power)
    try:
        same = math.isclose(conversion(own, asked), 1.0)
    except InputError:  # of another coefficient
        return own
    return own if same else asked


def relative_unit(sample: str, power: float) -> str:
    """U·s^power with the angle or acceleration and the time of U: deg/√h beside deg/h, rad/s/√Hz beside rad/s."""
    parsed = parse_unit(sample)
    name = parsed.name
    if parsed.kind == FREQUENCY and name == "1":
        return {0.0: "1", 0.5: "s^(1/2)", 1.0: "s", -0.5: "s^(-1/2)", -1.0: "1/s"}.get(
            power, f"s^{power:g}"
        )
    if name.endswith("/h"):
        return {
            1.0: name[:-2],
            0.5: f"{name[:-2]}/sqrt(h)",
            0.0: name,
            -0.5: f"{name}/sqrt(h)",
            -1.0: f"{name[:-2]}/h^2",
        }.get(power, f"({name})*s^{power:g}")
    return {
        1.0: name[:-2] if name.endswith("/s") else f"{name}*s",
        0.5: f"{name}*s^(1/2)" if parsed.kind == FREQUENCY else f"{name}/sqrt(Hz)",
        0.0: name,
        -0.5: f"{name}/sqrt(s)",
        -1.0: f"{name}/s",
    }.get(power, f"({name})*s^{power:g}")


def in_sheet(value: Estimate, sheet: Mapping[str, str]) -> Estimate:
    """A fitted number in the data-sheet unit of its kind of sensor; as it is where there is none.

    Where a unit was asked for it is in that, or as it is.
    """
    for kind, unit in sheet.items():
        try:
            found = value.to(unit)
        except InputError:
            continue
        asked = ASKED.get().get(kind)
        if asked is None:
            return found
        try:
            return value.to(asked)
        except InputError:
            return value
    return value


def in_table(
    value: Estimate, power: float | str, sheet: Mapping[str, str], sample: str
) -> Estimate:
    """A fitted number in the unit in which tables print it.

    `power` and `sheet` are the parameter's declared ``unit`` and ``sheet``, `sample` is the unit U of the samples; what is
    no U·s^power stays as it is.
    """
    if not isinstance(power, float):
        return value
    return value.to(table_unit(sample, power, sheet))


def sample_unit(text: str) -> str:
    """Unit of samples that ``--output-unit`` means: its own, or that behind a unit of a coefficient.

    ``deg/sqrt(h)`` is of samples in deg/h, ``ug/sqrt(Hz)`` in µg, ``m/s/sqrt(h)`` in m/s².

    Raises
    ------
    InputError
        Neither one nor the other.
    """
    try:
        return parse_unit(text).name
    except InputError as error:
        first = error
    tried = re.sub(r"\b(m?)dp([sh])\b", r"\1deg/\2", normalised(text))
    angle = re.match(rf"\s*({_NAMES})\b", tried)
    acceleration = re.match(r"\s*(?:([mun]?g)|(mm|cm|um|ft))\b", tried)
    if angle is not None:
        times = ("h", "s") if re.search(r"h", tried[angle.end() :]) else ("s", "h")
        candidates = [f"{angle[1]}/{t}" for t in times]
    elif acceleration is not None:
        candidates = [acceleration[1] or f"{acceleration[2]}/s^2"]
    else:
        candidates = ["m/s^2", "1"]
    for sample in candidates:
        for power in ("sqrt(s)", "1/sqrt(s)", "1/s", "s"):
            try:
                conversion(f"({sample})*{power}", text)
            except InputError:
                continue
            return parse_unit(sample).name
    raise first


_SPELLED = dict.fromkeys(("degc", "c", "celsius"), "°C") | dict.fromkeys(("degf", "f"), "°F")
_SPELLED |= dict.fromkeys(("kelvin", "k"), "K")
_SAID_BY_NAME = re.compile(
    r"(?:^|[_\W])(degC|degF|celsius|kelvin)$|temp(?:erature)?_?([CFK])$", re.IGNORECASE
)


def column_unit(name: str, stated: str | None = None) -> str:
    """Unit of a column that explains others, as it stands behind "per": °C, V, or the column's own name.

    Parameters
    ----------
    name : str
        Name of the column. ``die_degC``, ``temp_c`` say their unit; ``temperature`` does not.
    stated : str, optional
        Unit that the recording knows; None, an empty text and ``1`` are no unit.
    """
    said = _SAID_BY_NAME.search(name)
    text = (stated or "1").strip()
    if text == "1":
        text = "" if said is None else said[1] or said[2]
    text = _SPELLED.get(text.lower().replace("°", "deg").replace("º", "deg"), text) or name
    return f"({text})" if re.search(r"[/*·\s²^]", text) else text


def printed(unit: str, column: str = "") -> str:
    """A unit as it is printed: deg/sqrt(h) → °/√h; deg/s/Temp of a column Temp without a unit → °/s per unit of Temp."""
    head, slash, power = unit.rpartition(f"/{column}")
    if column and slash and power in ("", "²"):
        return f"{printed(head).removeprefix('1')} per unit{power} of {column}".strip()
    out = (
        unit.replace("s^(1/2)", "√s")
        .replace("s^(-1/2)", "1/√s")
        .replace("m/s^2/sqrt(s)", "m/s²/√s")
    )
    out = re.sub(r"sqrt\((\w+)\)", r"√\1", out)
    out = re.sub(r"\^(-?\d+)", lambda m: m[1].translate(_DIGITS), out).replace("*", "·")
    out = re.sub(r"\bmdeg\b", "m°", re.sub(r"\bdeg\b", "°", out))
    return re.sub(r"\bu(?=(g|rad)\b)", "µ", out)

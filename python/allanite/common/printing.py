"""Units in which tables print coefficients: those of data sheets, or those that were asked for."""

from __future__ import annotations

import re
from contextvars import ContextVar
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.units import FREQUENCY, conversion, parse_unit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.common.parameters import Estimate

__all__ = ["ASKED", "in_sheet", "in_table", "printed", "sample_unit", "table_unit"]

#: Whether the unit of the samples was asked for, and coefficients are printed in its relatives.
ASKED: ContextVar[bool] = ContextVar("asked", default=False)

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
        A data sheet's unit; where U was asked for, one of the same angle or acceleration and time: deg/√h beside deg/h,
        rad/s/√Hz beside rad/s.
    """
    parsed = parse_unit(sample)
    if parsed.kind == FREQUENCY:
        return {0.0: "1", 0.5: "s^(1/2)", 1.0: "s", -0.5: "s^(-1/2)", -1.0: "1/s"}.get(
            power, f"s^{power:g}"
        )
    if not ASKED.get() and parsed.kind in sheet:
        return sheet[parsed.kind]
    name = parsed.name
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
        0.5: f"{name}/sqrt(Hz)",
        0.0: name,
        -0.5: f"{name}/sqrt(s)",
        -1.0: f"{name}/s",
    }.get(power, f"({name})*s^{power:g}")


def in_sheet(value: Estimate, sheet: Mapping[str, str]) -> Estimate:
    """A fitted number in the data-sheet unit of its kind of sensor; as it is where there is none, or U was asked for."""
    if ASKED.get():
        return value
    for unit in sheet.values():
        try:
            return value.to(unit)
        except InputError:
            continue
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
    tried = re.sub(r"\b(m?)dps\b", r"\1deg/s", re.sub(r"[°º]", "deg", text))
    angle = re.match(rf"\s*({_NAMES})\b", tried)
    g = re.match(r"\s*([mµμun]?g)\b", text)
    candidates = []
    if angle is not None:
        times = ("h", "s") if re.search(r"h", tried[angle.end() :]) else ("s", "h")
        candidates = [f"{angle[1]}/{t}" for t in times]
    elif g is not None:
        candidates = [g[1]]
    else:
        candidates = ["m/s^2"]
    for sample in candidates:
        for power in ("sqrt(s)", "1/sqrt(s)", "1/s", "s"):
            try:
                conversion(f"({sample})*{power}", text)
            except InputError:
                continue
            return parse_unit(sample).name
    raise first


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

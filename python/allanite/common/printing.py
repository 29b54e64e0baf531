"""Units in which tables print coefficients: the units of data sheets, or the units that the user requested."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextvars import ContextVar
from types import MappingProxyType

from allanite.common.errors import InputError
from allanite.common.units import FREQUENCY, conversion, normalized, parse_unit

#: Units that the user requested, by kind of sensor. Each is a unit of samples or of a coefficient.
REQUESTED_UNITS: ContextVar[Mapping[str, str]] = ContextVar(
    "requested_units", default=MappingProxyType({})
)

_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_NAMES = r"(?:m?deg|arcsec|arcmin|m?rad|urad|rev)"


def table_unit(sample: str, power: float, sheet: Mapping[str, str]) -> str:
    """Unit in which tables print a coefficient in U·s^power of samples in U = `sample`.

    Without a requested unit for this kind of sensor (`REQUESTED_UNITS`), it is the data-sheet unit in `sheet`, by kind
    of sensor. A requested unit counts if it is a unit of this coefficient. Otherwise the unit is U·s^power.
    """
    parsed = parse_unit(sample)
    requested = REQUESTED_UNITS.get().get(parsed.kind)
    if requested is None:
        sample = "1" if parsed.kind == FREQUENCY else sample
        return sheet.get(parsed.kind) or relative_unit(sample, power)
    own = relative_unit(sample, power)
    try:
        same = math.isclose(conversion(own, requested), 1.0)
    except InputError:  # the requested unit is that of another coefficient
        return own
    return own if same else requested


def relative_unit(sample: str, power: float) -> str:
    """Unit U·s^power of a coefficient, for samples in U = `sample`: ``deg/s/sqrt(Hz)`` for deg/s and ½.

    For a unit per hour, the time is in hours: ``deg/sqrt(h)`` for deg/h and ½. Without a unit (``1``), it is a power of
    seconds such as ``s^(1/2)``. Other units with powers that are not −1, −½, 0, ½ or 1 read ``(U)*s^power``.
    """
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


def sample_unit(text: str) -> str:
    """Canonical unit of the samples, found from the text of a unit of samples or of a coefficient.

    ``deg/sqrt(h)`` belongs to samples in deg/h, ``ug/sqrt(Hz)`` to ug, ``m/s/sqrt(h)`` to m/s^2. Raises `InputError` if
    the text is neither a unit of samples nor of a coefficient.
    """
    try:
        return parse_unit(text).name
    except InputError as error:
        first = error
    tried = re.sub(r"\b(m?)dp([sh])\b", r"\1deg/\2", normalized(text))
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
    """Text for a logged column after the word "per": its `stated` unit, the unit in its name, or its name.

    ``die_degC`` and ``temp_c`` contain their unit, ``temperature`` does not. Several factors are in brackets:
    ``(m/s)``. A `stated` None, empty text or ``1`` is no unit.
    """
    named_unit = _SAID_BY_NAME.search(name)
    text = (stated or "1").strip()
    if text == "1":
        text = "" if named_unit is None else named_unit[1] or named_unit[2]
    text = _SPELLED.get(text.lower().replace("°", "deg").replace("º", "deg"), text) or name
    return f"({text})" if re.search(r"[/*·\s²^]", text) else text


def printed(unit: str, column: str = "") -> str:
    """Unit as it is printed: ``°/√h`` for ``deg/sqrt(h)``.

    With `column` Temp, the unit ``deg/s/Temp`` becomes ``°/s per unit of Temp``.
    """
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
    return re.sub(r"\bu(?=(g|rad|T)\b)", "µ", out)

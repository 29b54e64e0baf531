"""Words and numbers of figures: units as they are printed, coefficients in a few figures, times in fit units."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from allanite.common.numbers import number
from allanite.common.parameters import Estimate
from allanite.common.printing import in_sheet

if TYPE_CHECKING:
    from allanite.effects import Effect

__all__ = [
    "allan_label",
    "density_unit",
    "duration_text",
    "effect_text",
    "in_unit",
    "recording_text",
    "unit_text",
    "values_text",
]

_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def unit_text(unit: str) -> str:
    """A unit as it is printed: ``deg/s`` → °/s, ``ug`` → µg, ``rad/s·s^½`` → rad/√s."""
    text = unit
    for plain, root in (("/s·s^½", "/√s"), ("/s·s", ""), ("/s/s^½", "/s/√s"), ("/s/s", "/s²")):
        if text.endswith(plain):
            text = text[: -len(plain)] + root
            break
    text = re.sub(r"\bm/s\^2·s\^½$", "m/s/√s", text)
    text = re.sub(r"\bm/s\^2·s$", "m/s", text)
    text = re.sub(r"sqrt\((\w+)\)", r"√\1", text)
    text = text.replace("·s^½", "·√s").replace("/s^½", "/√s")
    text = re.sub(r"\^(-?\d+)", lambda m: m.group(1).translate(_DIGITS), text)
    text = re.sub(r"\bmdeg\b", "m°", re.sub(r"\bdeg\b", "°", text))
    text = re.sub(r"\bu(?=(g|rad|m|s)\b)", "µ", text)
    return re.sub(r"^1·|^1(?=/)", "1" if text.startswith("1/") else "", text)


def in_unit(words: str, unit: str) -> str:
    """``Allan deviation (°/s)``; a pure number has no bracket."""
    return words if unit in ("", "1") else bracket(words, unit_text(unit))


def allan_label(unit: str) -> str:
    """``Allan deviation (°/s)``; of a clock, whose samples have no unit, ``Allan deviation σ_y(τ)``."""
    return "Allan deviation σ_y(τ)" if unit == "1" else in_unit("Allan deviation", unit)


def bracket(words: str, unit: str) -> str:
    """A unit behind words, in brackets that do not meet its own."""
    return f"{words} [{unit}]" if unit.startswith("(") else f"{words} ({unit})"


def density_unit(unit: str) -> str:
    """Unit of a power spectral density of samples in `unit`."""
    if unit in ("", "1"):
        return "1/Hz"
    text = unit_text(unit)
    return f"({text})²/Hz" if "/" in text or "²" in text else f"{text}²/Hz"


def values_text(effect: Effect | type[Effect], values: dict[str, Any], most: int = 2) -> str:
    """``T 30.1 s, σ 0.0074 rad/s``: the numbers that say most of an effect, with units."""
    found: list[str] = []
    for name in effect.shown():
        value = values.get(name)
        if effect.parameter(name).role == "derived" and not value:
            # What follows from a coefficient that is 0 has no limit of its own.
            name = str(getattr(effect, "coefficient", name))
            value = values.get(name)
        if not isinstance(value, Estimate) or len(found) == most:
            continue
        declared = effect.parameter(name)
        symbol = declared.symbol or name
        value = in_sheet(value, declared.sheet)
        unit = "" if value.unit in ("", "1") else " " + unit_text(value.unit)
        # A time or frequency has no upper limit that says anything.
        size = value.unit not in ("s", "Hz")
        if size and not value.detected and value.interval is not None:
            found.append(f"{symbol} < {number(value.interval[1], 2)}{unit}")
        else:
            found.append(f"{symbol} {number(value.value)}{unit}")
    return ", ".join(found)


def effect_text(fit: Any, effect: Any) -> str:
    """Name of an effect for this sensor, with the column that it follows."""
    name = str(fit.display_name(effect))
    return f"{name} {effect.follows}" if effect.follows else name


def duration_text(seconds: float) -> str:
    """``2 h``, ``15 min``, ``40 s``."""
    for size, name in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2 * size or seconds == size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds:.3g} s"


def recording_text(recording: Any) -> str:
    """Which log, which column, how long."""
    from pathlib import Path

    name = Path(recording.path).name if recording.path else ""
    column = recording.columns[0] if recording.columns else ""
    what = " ".join(t for t in (name, column) if t) or "recording"
    return f"{what} · {duration_text(recording.duration)} at {recording.rate:.6g} Hz"

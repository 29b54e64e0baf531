"""Texts of figures: printed units, values of effects, durations, and descriptions of recordings."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from allanite.common.numbers import duration_text, number
from allanite.common.parameters import Estimate
from allanite.effects.sheet_units import in_sheet_unit

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit import Fit
    from allanite.recording.record import Record

#: Translation of minus and digits to superscripts.
_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def unit_text(unit: str) -> str:
    """Printed form of a unit: ``deg/s`` → °/s, ``ug`` → µg, ``rad/s·s^½`` → rad/√s."""
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


def with_unit(number: str, unit: str) -> str:
    """Text of a number with its printed unit, ``0.3 °/s``; without a unit (``""`` or ``"1"``), the number alone."""
    return number if unit in ("", "1") else f"{number} {unit_text(unit)}"


def label_in_unit(words: str, unit: str) -> str:
    """Axis label with its printed unit in brackets, e.g. ``Allan deviation (°/s)``; without a unit, the label alone."""
    return words if unit in ("", "1") else with_bracketed_unit(words, unit_text(unit))


def allan_label(unit: str) -> str:
    """Label ``Allan deviation (°/s)``; for clocks, whose samples have no unit, ``Allan deviation σ_y(τ)``."""
    return "Allan deviation σ_y(τ)" if unit == "1" else label_in_unit("Allan deviation", unit)


def with_bracketed_unit(words: str, unit: str) -> str:
    """Axis label ``rate (°/s)``; the brackets are square if the unit itself begins with one: ``density [(°/s)²/Hz]``."""
    return f"{words} [{unit}]" if unit.startswith("(") else f"{words} ({unit})"


def density_unit(unit: str) -> str:
    """Printed unit of a power spectral density of samples in `unit`: ``(°/s)²/Hz``, ``g²/Hz``; ``1/Hz`` without a unit."""
    if unit in ("", "1"):
        return "1/Hz"
    text = unit_text(unit)
    return f"({text})²/Hz" if "/" in text or "²" in text else f"{text}²/Hz"


def values_text(effect: Effect | type[Effect], values: dict[str, Any], most: int = 2) -> str:
    """Text of up to `most` values of an effect with units, in the order of `Effect.shown`: ``T = 30.1 s, σ = 12 °/h``.

    A value that was not detected is ``< limit``, except times and frequencies.
    """
    found: list[str] = []
    for name in effect.shown():
        value = values.get(name)
        if effect.parameter(name).role == "derived" and not value:
            # A value derived from a coefficient of 0 has no limit; show the coefficient instead.
            name = str(getattr(effect, "coefficient", name))
            value = values.get(name)
        if not isinstance(value, Estimate) or len(found) == most:
            continue
        declared = effect.parameter(name)
        symbol = declared.symbol or name
        value = in_sheet_unit(value, declared)
        # An upper limit of a time or a frequency is not meaningful.
        size = value.unit not in ("s", "Hz")
        if size and not value.detected and value.interval is not None:
            text = f"{symbol} < {number(value.limit, 2)}"
        else:
            text = f"{symbol} = {number(value.value)}"
        found.append(with_unit(text, value.unit))
    return ", ".join(found)


def effect_text(fit: Fit, effect: Effect) -> str:
    """Text of the name of an effect for this kind of sensor, followed by the logged column that it follows, if any."""
    name = fit.display_name(effect)
    return f"{name} {effect.follows}" if effect.follows else name


def recording_text(recording: Record) -> str:
    """Log, column, if only one, duration and rate of a recording: ``imu.csv gx · 2 h at 100 Hz``."""
    from pathlib import Path

    name = Path(recording.path).name if recording.path else ""
    column = recording.columns[0] if len(recording.columns) == 1 else ""
    what = " ".join(t for t in (name, column) if t) or "recording"
    return f"{what} · {duration_text(recording.duration)} at {recording.rate:.6g} Hz"

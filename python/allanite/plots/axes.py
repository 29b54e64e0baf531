"""Axes with margins around the data and ticks at round values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from allanite.common.numbers import number
from allanite.plots.spec import Axis

#: Translation of minus and digits to superscripts.
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Maximum number of labeled decades; with more decades, only every second (third, …) is labeled.
MOST_LABELS = 8


def finite_values(
    arrays: Iterable[Any], positive: bool = False
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """1-D array of all finite numbers in some arrays; with `positive`, only of the positive ones."""
    values = np.concatenate([np.zeros(0), *(np.ravel(np.asarray(a, dtype=float)) for a in arrays)])
    keep = np.isfinite(values) & ((values > 0) | (not positive))
    return np.asarray(values[keep])


def log_axis(label: str, *arrays: Any, margin: float = 1.15) -> Axis:
    """Logarithmic `Axis` that covers the positive numbers of `arrays`, extended by the factor `margin` at both ends.

    If it spans less than a factor of 2, both ends move by a further factor of 1.5. At most 8 powers of ten are labeled.
    Below three of them, multiples such as 1, 2, 5 are ticks, too.
    """
    values = finite_values(arrays, positive=True)
    if values.size == 0:
        values = np.array([1.0])
    low, high = float(values.min()) / margin, float(values.max()) * margin
    if high / low < 2.0:
        low, high = low / 1.5, high * 1.5
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    decades = [k for k in range(first, last + 1) if low <= 10.0**k <= high]
    minor = [
        m * 10.0**k
        for k in range(first, last + 1)
        for m in range(2, 10)
        if low <= m * 10.0**k <= high
    ]
    plain = low >= 9e-4 and high < 1.1e5
    if len(decades) >= 3:
        step = -(-len(decades) // MOST_LABELS)
        ticks = [(10.0**k, power_text(k, plain)) for k in decades if k % step == 0]
        if step > 1:
            minor = [10.0**k for k in decades if k % step]
    else:
        # On few decades, 1, 2, 5 are labeled too, so that values can be read.
        chosen = range(1, 10) if high / low < 4 else (1, 2, 5) if high / low < 60 else (1, 3)
        steps = [(m, k) for k in range(first, last + 1) for m in chosen]
        kept = [(m, k) for m, k in steps if low <= m * 10.0**k <= high]
        ticks = [(m * 10.0**k, power_text(k, plain, m)) for m, k in kept]
        minor = [v for v in minor if all(abs(v / t - 1) > 1e-9 for t, _ in ticks)]
    return Axis(label, low, high, True, tuple(ticks), tuple(minor))


def power_text(exponent: int, plain: bool, mantissa: int = 1) -> str:
    """Tick text of mantissa·10^exponent: 0.001 if `plain`, otherwise 10⁻³; with mantissa 2: 0.002 or 2·10⁻³."""
    if plain:
        return f"{mantissa * 10.0**exponent:.6g}"
    power = "10" + str(exponent).translate(_SUPERSCRIPT)
    return power if mantissa == 1 else f"{mantissa}·{power}"


def linear_axis(label: str, low: float, high: float, ticks: int = 5, reverse: bool = False) -> Axis:
    """Linear `Axis` from `low` to `high` with at most about `ticks` ticks, at multiples of 1, 2 or 5·10ᵏ."""
    if not high > low:
        low, high = low - 0.5, high + 0.5
    raw = (high - low) / ticks
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(m * size for m in (1, 2, 5, 10) if m * size >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    places = tuple((k * step, number(k * step, 6)) for k in range(first, last + 1))
    return Axis(label, low, high, False, places, reverse=reverse)


def score_axis(label: str, *scores: Any) -> Axis:
    """Symmetric linear `Axis` for standard normal scores that covers all scores and at least ±4.6, with three ticks."""
    values = np.abs(finite_values(scores))
    top = max(4.6, 1.12 * float(values.max()) if values.size else 0.0)
    sizes = [m * 10.0**k for k in range(7) for m in (1, 2, 4, 5)]
    tick = max(v for v in sizes if v <= 0.9 * top)
    return Axis(label, -top, top, False, ((-tick, f"−{tick:g}"), (0.0, "0"), (tick, f"+{tick:g}")))


def step_axis(texts: Iterable[str]) -> Axis:
    """Categorical `Axis` with the ticks 0, 1, …, one per text, the first at the top."""
    ticks = tuple((float(i), text) for i, text in enumerate(texts))
    return Axis("", -0.6, len(ticks) - 0.4, False, ticks, reverse=True)

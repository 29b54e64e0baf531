"""Times and durations as text."""

from __future__ import annotations

import math

from allanite.common.numbers import number


def time_text(seconds: float) -> str:
    """Text of a time error with three digits in s, ms, µs, ns or ps, such as ``1.25 ns``; a dash for NaN."""
    if math.isnan(seconds):
        return "–"
    for name, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)):
        if abs(seconds) >= size:
            return f"{seconds / size:.3g} {name}".replace("-", "−")
    return f"{seconds / 1e-12:.3g} ps".replace("-", "−")


def powered_text(values: tuple[float, float], between: str) -> str:
    """Text of two numbers with a common power of ten and `between` between them: ``(1.230 ± 0.030)·10⁻¹⁰``.

    The decimals are chosen so that the number closer to 0 has at least two digits. There is no power of ten if the
    larger absolute value is from 10⁻³ to below 10⁴.
    """
    known = [abs(v) for v in values if math.isfinite(v) and v]
    if not known:
        return between.join(f"{v:g}" for v in values)
    power = math.floor(math.log10(max(known)))
    power = 0 if -3 <= power <= 3 else power
    digits = max(0, 1 + power - math.floor(math.log10(min(known))))
    first, second = (f"{v / 10.0**power:.{digits}f}".replace("-", "−") for v in values)
    text = f"{first}{between}{second}"
    return text if power == 0 else f"({text})·{number(10.0**power, 1, power=True)}"

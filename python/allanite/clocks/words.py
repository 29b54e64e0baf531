"""Times and durations as text."""

from __future__ import annotations


def time_text(seconds: float) -> str:
    """Text of a time error with three digits in s, ms, µs, ns or ps: ``1.25 ns``; the largest unit of which it has one."""
    for name, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)):
        if abs(seconds) >= size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds / 1e-12:.3g} ps"

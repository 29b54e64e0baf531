"""Text table of a thermal calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import number, with_readable_numbers
from allanite.common.printing import printed

if TYPE_CHECKING:
    from allanite.calibration.law import AxisLaw
    from allanite.statespace.growth import Growth


def axis_lines(axis: AxisLaw) -> list[str]:
    """List of texts: headline of one axis, then indented lines: coefficients, hysteresis, noise, offsets, deviations.

    Results that do not exist have no line, except hysteresis, which is then "not checked".
    """
    unit = printed(axis.unit)
    lines = [axis.headline]
    if axis.alternatives:
        lines.append(
            f"  the data agree as well with: {', '.join(f.name for f in axis.alternatives)}"
        )
    if axis.numbers:
        numbers_text = (
            f"{name} {value}" if not value.detected else f"{name} = {value}"
            for name, value in axis.numbers.items()
        )
        shown = with_readable_numbers("; ".join(numbers_text))
        lines.append(f"  coefficients relative to {number(axis.curve.reference, 4)} °C: {shown}")
    if axis.loop is None:
        lines.append(
            "  bias while cooling minus while warming: not checked, because no temperature was passed in both directions"
        )
    else:
        value, (low, high) = axis.loop.value, axis.loop.interval
        text = f"{number(value, 2)} ({number(low, 2)} … {number(high, 2)}) {unit}"
        if not axis.loop.detected:
            text = f"not detected, at most {number(max(abs(low), abs(high)), 2)} {unit}"
        lines.append(f"  bias while cooling minus while warming, on average: {text}")
    if axis.noise is not None:
        low, high = axis.noise.interval
        shown = f"{number(axis.noise.percent, 2)} ({number(low, 2)} … {number(high, 2)}) % per °C"
        lines.append(
            f"  white noise: changes by {shown}"
            if axis.noise.detected
            else f"  white noise: no change with temperature detected, {shown}"
        )
    walk = axis.random.get("K")
    if axis.walk_of_steps > 0.0 and walk is not None and not walk.detected:
        lines.append(f"  K {walk}: the coarse steps of the thermometer can explain all of it")
    if len(axis.offsets) > 1:
        each = ", ".join(number(v) for v in axis.offsets)
        lines.append(f"  bias of each run at {number(axis.curve.reference, 4)} °C: {each} {unit}")
    lines.append(_deviation_line(axis, unit))
    lines += [
        _growth_line(a, b) for a, b in zip(axis.growth_before, axis.growth_after, strict=True)
    ]
    return [line for line in lines if line]


def _deviation_line(axis: AxisLaw, unit: str) -> str:
    """Text with the Allan deviation before and after correction at up to three averaging times; empty without any.

    A second line follows if a law was found but correcting raises the Allan deviation at the longest averaging times.
    """
    r = axis.remainder
    if not r.tau.size:
        return ""
    wanted = [t for t in 10.0 ** np.arange(-3.0, 8.0) if r.tau[0] <= t <= r.tau[-1]]
    places = dict.fromkeys(
        [*(int(np.argmin(np.abs(np.log(r.tau / t)))) for t in wanted), r.tau.size - 1]
    )
    shown = (
        f"{number(r.tau[k], 2)} s {number(r.before[k], 2)} → {number(r.after[k], 2)}"
        for k in list(places)[-3:]
    )
    line = f"  Allan deviation before → after correction: {', '.join(shown)} {unit}"
    helps = np.flatnonzero(r.after <= r.before)
    worse = r.tau[helps[-1] + 1 if helps.size else 0 :]
    if worse.size and axis.form.numbers:
        line += f"\n  ! correcting raises the Allan deviation from {number(worse[0], 2)} s on: other noise hides the law"
    return line


def _growth_line(before: Growth, after: Growth) -> str:
    """Line of text: an error at some times after the last position fix, without and with the thermal correction.

    `` angle error after the last fix, before → after correction: 60 s 0.2 → 0.1 °``.
    """
    unit, factor = before.display_unit
    shown = (
        f"{number(t, 3)} s {number(factor * a, 2)} → {number(factor * b, 2)}"
        for t, a, b in zip(before.tau, before.total, after.total, strict=True)
    )
    return f"  {before.quantity} error after the last fix, before → after correction: {', '.join(shown)} {printed(unit)}"

"""Figures of deviations with their intervals, and of a deviation in moving windows over the record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import duration_text, number, time_scale
from allanite.common.showing import aligned_lines
from allanite.deviation import estimator_named
from allanite.effects.sheet_units import in_figure_unit
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Axis, Figure, Line, Mark, Note, Panel, Points
from allanite.plots.themes import COMPONENTS, LOGS
from allanite.plots.words import label_in_unit, recording_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from allanite.deviation.dynamic import DynamicDeviation
    from allanite.deviation.result import Deviation
    from allanite.recording.record import Record

#: (Slope of σ(τ) on logarithmic axes, label) of common clock noise.
SLOPES = ((-1.0, "τ⁻¹"), (-0.5, "τ⁻¹ᐟ²"), (0.5, "τ¹ᐟ²"))
#: Half the width and half the height of the label of a slope, as fractions of the panel in a column of a journal.
LABEL_WIDTH, LABEL_HEIGHT = 0.05, 0.06
#: Maximum number of windows that are marked individually.
MAX_MARKED = 80


def plot_deviation(
    deviation: Deviation,
    path: str | Path | None = None,
    theme: str = "light",
    recording: Record | None = None,
) -> Figure:
    """`Figure`: a deviation over averaging time, with its interval if known, on logarithmic axes.

    Parameters
    ----------
    deviation : Deviation
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}
    recording : Recording, optional
        Named in the subtitle.

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    deviation = in_figure_unit(deviation)
    points = deviation_points(deviation, "measured", "estimate")
    marks = (Line(points.x, points.y, "c1", width=1.4), points)
    y = log_axis(_axis_label(deviation), deviation.deviation, deviation.low, deviation.high)
    panel = Panel(log_axis(TAU, points.x), y, marks)
    words = estimator_named(deviation.kind).title
    text = f"{points.x.size} averaging times" if recording is None else recording_text(recording)
    figure = Figure(words[0].upper() + words[1:], text, (panel,), kind="deviation")
    return figure.saved(path, theme)


def deviation_points(deviation: Deviation, color: str, label: str) -> Points:
    """`Points` of a deviation at the τ (s) where it is finite and positive, so that logarithmic axes can show it.

    If its confidence interval is known, the points have error bars, and the label becomes ``label ± 95 %``.
    """
    values, low = np.asarray(deviation.deviation), np.asarray(deviation.low)
    kept = np.isfinite(values) & (values > 0)
    tau = np.asarray(deviation.tau)[kept]
    if not np.isfinite(low[kept]).any():
        return Points(tau, values[kept], color, label)
    label, high = f"{label} ± {deviation.percent}", np.asarray(deviation.high)
    return Points(tau, values[kept], color, label, low[kept], high[kept])


def _axis_label(deviation: Deviation) -> str:
    """Text of the axis label: name of the estimator with its unit; for clocks with its symbol, such as σ_y(τ)."""
    words = [estimator_named(deviation.kind).title, _symbol(deviation)]
    return label_in_unit(", ".join(filter(None, words)), deviation.deviation_unit)


def _symbol(deviation: Deviation) -> str:
    """Symbol of a deviation of fractional frequency, such as σ_y(τ); empty in other units, or if there is none."""
    return estimator_named(deviation.kind).symbol if deviation.unit == "1" else ""


def plot_stability(
    deviations: Sequence[Deviation],
    path: str | Path | None = None,
    theme: str = "light",
    recording: Record | None = None,
) -> Figure:
    """`Figure`: several deviations of one record with intervals, guide lines for noise slopes, and a table of the values.

    The deviations have one unit. The first six are drawn; the table has all. The subtitle names the `recording`. The
    figure is written to `path` (SVG, PNG or PDF) if given. With `path`, raises `InputError` for another suffix, for a
    folder that does not exist, or without matplotlib.
    """
    deviations = [in_figure_unit(one) for one in deviations]
    first = deviations[0]
    marks: list[Mark] = []
    shown: list[np.ndarray] = []
    for deviation, role in zip(deviations, LOGS, strict=False):
        label = f"{_symbol(deviation)} {deviation.kind.upper()}".strip()
        points = deviation_points(deviation, role, label)
        marks += [Line(points.x, points.y, role, width=1.2), points]
        shown += [points.y] if points.low is None else [points.y, points.low]
    x = log_axis(TAU, *(np.asarray(d.tau) for d in deviations))
    kinds = {d.deviation_unit for d in deviations}
    words = (
        _axis_label(first)
        if len(deviations) == 1
        else label_in_unit("deviation", first.deviation_unit)
    )
    if len(deviations) > 1 and first.unit == "1" and len(kinds) == 1:
        words = "σ_y(τ)"
    y = log_axis(words, *shown)
    # White PM falls faster in the modified deviation only.
    slopes = ((-1.5, "τ⁻³ᐟ²"), *SLOPES) if first.kind == "mdev" else SLOPES
    guides = [
        mark for s, name in slopes for mark in _slope_guide(deviations, s, name, slopes, x, y)
    ]
    panel = Panel(x, y, (*guides, *marks))
    title = "Stability" if first.unit == "1" else "Deviations"
    subtitle = "" if recording is None else recording_text(recording)
    figure = Figure(title, subtitle, (panel,), kind="stability", below=_deviation_table(deviations))
    return figure.saved(path, theme)


def _slope_guide(
    deviations: Sequence[Deviation],
    slope: float,
    name: str,
    slopes: Sequence[tuple[float, str]],
    x: Axis,
    y: Axis,
) -> tuple[Line, Note]:
    """(dotted `Line` with a given log-log slope through the middle of the first curve, `Note` with its label `name`).

    The label is near the low end of the line, apart from points and intervals, and closer to this line than to the
    lines of the other `slopes`.
    """
    points = deviation_points(deviations[0], "", "")
    tau, values = points.x, points.y
    middle, ends = tau.size // 2, tau[[0, -1]]
    heights = values[middle] * (ends / tau[middle]) ** slope

    def relative_position(value: NDArray[Any], axis: Axis) -> NDArray[np.float64]:
        """Positions (0 to 1) of values on a logarithmic axis."""
        return np.asarray(np.log(value / axis.low) / np.log(axis.high / axis.low))

    # Place the label on the line as close to its low end as the panel allows, because the legend is in the upper corner.
    steps = np.linspace(1.0, 0.0, 50)
    low_end = ends[1] if slope < 0 else ends[0]
    at = np.exp(np.log(tau[middle]) + steps * np.log(low_end / tau[middle]))
    # Candidate positions of the label's center: on both sides of each point of the line.
    steepness = _steepness(slope, x, y)
    side = 0.04 / np.hypot(1.0, steepness) * np.array([1.0, -1.0])
    across = (relative_position(at, x)[:, np.newaxis] - steepness * side).ravel()
    up = relative_position(values[middle] * (at / tau[middle]) ** slope, y)
    up = (up[:, np.newaxis] + side).ravel()
    inside = (up > 0.04) & (up < 0.93) & (across > 0.05) & (across < 0.95)
    label_tau = x.low * (x.high / x.low) ** across

    def distance(other: float) -> NDArray[np.float64]:
        """Distances of the candidate positions from the line of slope `other`, as fractions of the panel."""
        height = relative_position(values[middle] * (label_tau / tau[middle]) ** other, y)
        return np.asarray(np.abs(up - height) / np.hypot(1.0, _steepness(other, x, y)))

    for other, _ in slopes:
        if other != slope:
            inside &= distance(other) > distance(slope) + 0.5 * LABEL_HEIGHT
    clear = np.ones(across.size, dtype=bool)
    for d in deviations:
        there, own = relative_position(np.asarray(d.tau), x), np.asarray(d.deviation)
        bottom, top = (
            relative_position(np.fmax(np.where(np.isfinite(v), v, own), y.low), y)
            for v in (d.low, d.high)
        )
        beside = np.abs(there - across[:, np.newaxis]) < LABEL_WIDTH
        level = (bottom < up[:, np.newaxis] + LABEL_HEIGHT) & (
            top > up[:, np.newaxis] - LABEL_HEIGHT
        )
        clear &= ~(beside & level).any(axis=1)
    k = next((int(one.argmax()) for one in (inside & clear, inside) if one.any()), 0)
    line = Line(ends, heights, "guide", width=0.8, dash="dot")
    return line, Note(float(across[k]), float(up[k]), name, "guide")


def _steepness(slope: float, x: Axis, y: Axis) -> float:
    """Rise of a line with the log-log `slope` over the width of the panel, as a fraction of its height."""
    return float(slope * np.log(x.high / x.low) / np.log(y.high / y.low))


def _deviation_table(deviations: Sequence[Deviation]) -> str:
    """Text table of τ and each deviation with its interval, one line per averaging time; dashes for missing values."""
    taus = np.sort([float(t) for t in {f"{t:.6g}" for d in deviations for t in d.tau}])
    rows = [
        [
            "τ (s)",
            *(c for d in deviations for c in (d.kind, f"low {d.percent}", f"high {d.percent}")),
        ]
    ]
    for t in taus:
        row = [f"{t:.6g}"]
        for d in deviations:
            (found,) = np.nonzero(np.isclose(d.tau, t, rtol=1e-5))
            cells = [v[found[0]] if found.size else np.nan for v in (d.deviation, d.low, d.high)]
            row += [number(v, 4, power=True) if np.isfinite(v) else "–" for v in cells]
        rows.append(row)
    return "\n".join(aligned_lines(rows, right=True))


def plot_dynamic(
    dynamic: DynamicDeviation, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """`Figure`: overlapping Allan deviation of windows along the record, over time, with a line for each of up to six τ.

    Lines are interrupted where a value is NaN. With at most 80 windows, each value is also a point.

    Parameters
    ----------
    dynamic : DynamicDeviation
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    half = 0.5 * dynamic.window
    low, high = float(dynamic.time[0]) - half, float(dynamic.time[-1]) + half
    size, name = time_scale(high - low)
    marks: list[Mark] = []
    for color, k in zip(COMPONENTS, dynamic.shown(len(COMPONENTS)), strict=False):
        time, values = dynamic.time / size, dynamic.deviation[:, k]
        marks.append(Line(time, values, color, f"τ = {dynamic.tau[k]:.4g} s"))
        if time.size <= MAX_MARKED:
            marks.append(Points(time, values, color, size=3.0))
    words = "overlapping Allan deviation"
    shown = [m.y for m in marks if isinstance(m, Line)]
    panel = Panel(
        linear_axis(f"time ({name})", low / size, high / size, 8),
        deviation_axis(dynamic.unit, log_axis("", np.concatenate(shown)), words),
        tuple(marks),
    )
    windows = f"{dynamic.time.size} windows of {duration_text(dynamic.window)}"
    figure = Figure(words[0].upper() + words[1:] + " over time", windows, (panel,), kind="dynamic")
    return in_figure_units(figure).saved(path, theme)

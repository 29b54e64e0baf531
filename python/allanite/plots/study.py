"""Figure of the stepwise model building: errors of each step, and the curves of the first and the last model."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import number
from allanite.fit.likelihood.peaks import is_narrow
from allanite.plots.axes import linear_axis, log_axis, step_axis
from allanite.plots.curves import SINGLE, TAU, interval, spectrum_panels
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Band, Bars, Figure, Line, Mark, Panel, Points, Rule
from allanite.plots.words import effect_text, recording_text, values_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from allanite.effects import Model
    from allanite.study import Rung, Study

#: Maximum number of letters of a title, of a model in the legend, and of text lines for the names of all steps.
TITLE, LEGEND, LINES = 92, 32, 31


def plot_study(study: Study, path: str | Path | None = None, theme: str = "light") -> Figure:
    """`Figure`: errors of each step, and the Allan deviation and the spectrum with the first and the last model.

    The errors are the unexplained misfit, the error of the Allan deviation, and the model discrepancy if a step has
    one.
    They are left out if the study has one step.

    Parameters
    ----------
    study : Study
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    ladder = study.ladder
    names = _step_texts(ladder)
    fits = [step.fit for step in ladder]
    chance = fits[-1].error.chance_rms_percent
    bars: list[tuple[str, list[float | None], float | None]] = [
        ("unexplained misfit (%)", list(study.misfit_left), None),
        ("Allan error (% rms)", [f.error.adev_rms_percent for f in fits], chance),
    ]
    discrepancies = [f.discrepancy.percent for f in fits]
    if any(discrepancies):
        bars.append(("model discrepancy (%)", [*discrepancies], None))
    if len(ladder) == 1:
        bars = []
    panels = (
        *(_bar_panel(words, names, values, at, i) for i, (words, values, at) in enumerate(bars)),
        _deviation_panel(study, len(bars)),
        _density_panel(study, len(bars)),
    )
    title = f"{recording_text(study.recording)} · from {fits[0].model.name} to "
    last = fits[-1].model
    title += _model_text(last, TITLE - len(title))
    heights, widths = (1.0, 1.0), (*(1.0 for _ in bars), 3.2)
    figure = Figure(title, _ending_text(study), panels, heights, widths, kind="study")
    return in_figure_units(figure).saved(path, theme)


def _model_text(model: Model, letters: int = LEGEND) -> str:
    """Name of a model, or the number of its effects if the name is longer than `letters`."""
    return model.name if len(model.name) <= letters else f"{len(model)} effects"


def _step_texts(ladder: Sequence[Rung]) -> tuple[str, ...]:
    """One text per step, printed at its bar: the changes of the step, one per line, with values of new effects.

    The values are left out if they need so many lines that they would touch the text of the bar above or below.
    """
    full, short = ([_step_text(step, numbers) for step in ladder] for numbers in (True, False))
    lines = [text.count("\n") + 1 for text in full]
    neighbor_lines = [
        max(lines[max(0, i - 1) : i] + lines[i + 1 : i + 2], default=0) for i in range(len(lines))
    ]
    fits = [
        own + other <= 2 * LINES // len(lines)
        for own, other in zip(lines, neighbor_lines, strict=True)
    ]
    return tuple(a if fit else b for a, b, fit in zip(full, short, fits, strict=True))


def _step_text(step: Rung, numbers: bool) -> str:
    """Changes of one step, one per line; "start" and the model for the first step.

    With `numbers`, a line below each new effect has its values, unless the step removed an effect.
    """
    if not step.changes:
        return f"start\n{step.fit.model.name}"
    if step.removed or not numbers:
        return "\n".join(step.changes)
    # New effects are at the end of the model, in the order in which they were added.
    new = list(zip(step.fit.model.effects, step.fit.estimates, strict=True))[-len(step.new) :]
    last = []
    for effect in step.new:
        at = next((i for i, pair in enumerate(new) if pair[0].kind == effect.kind), None)
        last.append("" if at is None else values_text(*new.pop(at), most=1))
    lines = [f"+ {effect_text(step.fit, step.new[0])}", *step.changes[1:]]
    return "\n".join(text for pair in zip(lines, last, strict=True) for text in pair if text)


def _bar_colors(steps: int) -> tuple[str, ...]:
    """Color role of each bar, as for curves: ``"model"`` for the first, ``"c1"`` for the last, ``"before"`` for others."""
    return tuple("c1" if i == steps - 1 else "model" if i == 0 else "before" for i in range(steps))


def _bar_panel(
    label: str, names: tuple[str, ...], values: list[float | None], guide: float | None, column: int
) -> Panel:
    """`Panel` of bars for one error measure, one bar (or ``–``) per step; `guide` is the position of a dashed line.

    None in `values` gives ``–``. Names are shown in column 0 only.
    """
    numbers = np.array([np.nan if v is None else v for v in values], dtype=float)
    texts = tuple("–" if v is None else number(v) for v in values)
    marks: list[Mark] = [Bars(numbers, texts, _bar_colors(len(values)))]
    if guide is not None:
        marks.append(Rule(guide, "x", "measured", "dash", "expected scatter", 1.3))
    shown = numbers[np.isfinite(numbers)]
    top = max([*shown, guide or 0.0]) or 1.0
    low = min([*shown, 0.0])
    # Leave space for the number at the end of the longest bar.
    margin = 0.42 * (top - low)
    x = linear_axis(label, low - (margin if low < 0 else 0.0), top + margin, 3)
    return Panel(x, step_axis(names), tuple(marks), 0, column, rows=2, show_y=column == 0)


def _deviation_panel(study: Study, column: int) -> Panel:
    """`Panel` of the measured Allan deviation with the first and the last model, and the scatter expected from the last."""
    first, last = study.ladder[0].fit, study.fit
    curve = last.curve
    low, high = interval(curve.measured, curve.edf)
    before, after = (
        f"{w} model: {_model_text(f.model)}" for w, f in (("first", first), ("last", last))
    )
    marks: list[Mark] = [
        Band(
            curve.tau,
            curve.low,
            curve.high,
            "c1",
            "expected scatter (95 %) if the last model is true",
        )
    ]
    marks.append(Line(curve.tau, curve.model, "c1", after, 2.2))
    if len(study.ladder) > 1:
        # Dashes on top leave both models visible where they agree.
        marks.append(Line(first.curve.tau, first.curve.model, "model", before, 2.0, "dash"))
    marks.append(Points(curve.tau, curve.measured, "measured", "measured ± 95 %", low, high))
    sure = curve.edf >= 2.0
    y = log_axis("", curve.measured, curve.model, first.curve.model, high[sure], low[sure])
    y = deviation_axis(study.recording.unit, y)
    return Panel(log_axis(TAU, curve.tau), y, tuple(marks), column=column, title="Allan deviation")


def _density_panel(study: Study, column: int) -> Panel:
    """`Panel` of the measured density with the first and the last model, and single ordinates around lines and bands."""
    first, last = study.ladder[0].fit, study.fit
    lines = [e for e in last.model.deterministic if e.base_frequency is not None]
    bands = [0.5 * (low + high) for e in last.model if is_narrow(e) for low, high in e.peaks]
    places = [*(e.base_frequency for e in lines if e.base_frequency), *bands]
    panel = spectrum_panels(first, column, (), places)[0]
    after = spectrum_panels(last, column)[0]
    marks: list[Mark] = [
        replace(m, label="", color="c1") for m in after.find(Line) if m.color == "model"
    ]
    if len(study.ladder) > 1:
        marks += [
            replace(m, label="", width=2.0, dash="dash")
            for m in panel.find(Line)
            if m.color == "model"
        ]
    for effect in lines:
        for multiple, amplitude, _ in effect.lines:
            # A line of amplitude A adds A² T / 2 to its ordinate of the two-sided density.
            at = multiple * (effect.base_frequency or 0.0)
            peak = 0.5 * amplitude**2 * last.data.duration
            marks.append(Line(np.array([at, at]), np.array([panel.y.low, peak]), "c1", "", 2.2))
    # The measured ordinates are above the lines of the model, which would hide them. The points are those of the last
    # model, without its known functions of time, and hollow with them.
    marks += [m for m in panel.find(Line) if m.label == SINGLE]
    marks += after.find(Points)
    low, high = min(panel.y.low, after.y.low), max(panel.y.high, after.y.high)
    y = replace(
        log_axis(panel.y.label, np.array([low, high]), margin=1.0), quantity=panel.y.quantity
    )
    return replace(panel, y=y, marks=tuple(marks), row=1, show_x=True)


def _ending_text(study: Any) -> str:
    """Text: number of effects in the last model that the first model lacks, and why the model building ended."""
    last, first = (Counter(e.kind for e in fit.model) for fit in (study.fit, study.ladder[0].fit))
    added = (last - first).total()
    what = "no effect" if not added else f"{added} effect{'s' if added > 1 else ''}"
    return f"{what} added; stopped: {study.ending}"

"""Figures of a fit and of a check: Allan deviation and spectrum side by side, residuals below."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.numbers import number, p_text, time_scale
from allanite.effects import Deterministic
from allanite.fit.likelihood.peaks import has_all_ordinates
from allanite.plots.curves import (
    allan_panels,
    missing_lines,
    spectrum_panels,
    spectrum_spans,
    tau_spans,
)
from allanite.plots.recording import column_panel, means_panel, signal_line
from allanite.plots.scaling import in_figure_units
from allanite.plots.spec import Figure, Panel, Span
from allanite.plots.words import effect_text, recording_text, values_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from allanite.fit.result import Fit
    from allanite.suggestion import Check


def plot_fit(fit: Fit, path: str | Path | None = None, theme: str = "light") -> Figure:
    """`Figure`: Allan deviation and spectrum with the model, its band and its effects; residuals in σ below each.

    Parameters
    ----------
    fit : Fit
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Returns
    -------
    Figure
        The figure as data; notebooks display it.

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    figure = _fit_figure(fit)
    return figure.saved(path, theme)


def plot_check(check: Check, path: str | Path | None = None, theme: str = "light") -> Figure:
    """`Figure` as from `plot_fit`, with ranges shaded in which the model fails, and the strongest missing effect named.

    Panels on the right show the samples over time if the model fails at some time. They also do if a missing effect is
    a function of time; a logged column that this effect follows is drawn below. The figure is written to `path` (SVG,
    PNG or PDF) if given. Raises `InputError` if this is not possible.
    """
    fit = check.fit
    spans = spectrum_spans(fit, check.where.worst_frequency)
    figure = _fit_figure(fit, tau_spans(fit), spans, missing_lines(check), _time_panels(check))
    figure = replace(figure, subtitle=_check_subtitle(check), kind="check")
    return figure.saved(path, theme)


def _fit_figure(
    fit: Fit,
    tau: Sequence[Span] = (),
    frequency: Sequence[Span] = (),
    lines: Sequence[float] = (),
    more: tuple[Panel, ...] = (),
) -> Figure:
    """`Figure` of a fit with shaded ranges of τ and frequency, single ordinates at `lines` (Hz), and `more` panels."""
    panels = (*allan_panels(fit, tau), *spectrum_panels(fit, 1, frequency, lines), *more)
    figure = Figure(
        f"{recording_text(fit.recording)} · model {fit.model.name}",
        goodness_of_fit_text(fit),
        panels,
        heights=(3.4, 1.0),
        widths=(1.0,) * (3 if more else 2),
        kind="fit",
    )
    return in_figure_units(figure)


def _time_panels(check: Check) -> tuple[Panel, ...]:
    """Panel with means of the samples over time, and one with the logged column that the missing effect follows, if any.

    The time range in which the model fails is shaded, and the first missing effect that is a slow function of time is
    drawn. Empty if there is neither, for summaries, and if over 10 % of the samples are missing.
    """
    fit, worst = check.fit, check.where.worst_time
    missing = (s.effect for s in check.significant)
    # A line with thousands of periods would fill the panel.
    slow = (e for e in missing if isinstance(e, Deterministic) and e.occupies is None)
    effect = next(slow, None)
    if not has_all_ordinates(fit.data) or (effect is None and worst is None):
        return ()
    log = fit.recording.recording()
    signal = None if effect is None else fit.data.signal([effect])
    panel = means_panel(log, signal)
    x = replace(panel.x, ticks=panel.x.ticks[:: 1 + len(panel.x.ticks) // 5])
    marks = list(panel.marks)
    if worst is not None:
        size, _ = time_scale(log.duration)
        marks.insert(0, Span(worst[0] / size, worst[1] / size, "fail", "when the model fails"))
    if effect is not None and signal is not None:
        marks.append(signal_line(log, signal, f"explained by {effect_text(fit, effect)}"))
    above = replace(panel, x=x, column=2, title="Samples", marks=tuple(marks))
    name = "" if effect is None or effect.follows is None else effect.follows
    if name not in log.covariates:
        return (replace(above, rows=2),)
    below = column_panel(log, name, log.covariates[name], x, 1)
    return replace(above, show_x=False), replace(below, column=2)


def goodness_of_fit_text(fit: Fit) -> str:
    """χ² per degree of freedom, p-value, and, if known, rms residual of the Allan deviation with its expected scatter."""
    misfit, error = fit.misfit, fit.error
    text = f"χ²/dof {number(misfit.reduced)} ({p_text(misfit.p_value)})"
    if error.adev_rms_percent is not None and error.chance_rms_percent is not None:
        text += (
            f" · Allan deviation: residual {number(error.adev_rms_percent, 2)} % rms"
            f" (expected scatter: {number(error.chance_rms_percent, 2)} %)"
        )
    return text


def _check_subtitle(check: Check) -> str:
    """Text of two lines: goodness of fit, and the strongest missing effect or a sentence that none is known."""
    text = goodness_of_fit_text(check.fit)
    if check.significant:
        first = check.significant[0]
        numbers = values_text(first.effect, first.estimates)
        name = effect_text(check.fit, first.effect)
        return f"{text}\nStrongest missing effect: {name} ({numbers}), {first.removes_text}"
    if check.adequate:
        return f"{text}\nNo effect is significantly missing"
    return f"{text}\nThe model fails, and no effect of the catalog explains the misfit"

"""Figures of the page as data, used for the screen, files and tables."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import count_text, duration_text, number, p_text, time_scale
from allanite.common.units import parse_unit
from allanite.comparison import limit_line
from allanite.effects import Deterministic, Stochastic
from allanite.effects.sheet_units import figure_unit, requested_units
from allanite.fit.likelihood.peaks import has_all_ordinates
from allanite.page.edits import chosen_units
from allanite.page.shown.deviations import deviation_figure, simulated_sensor
from allanite.page.shown.jobs import average_figure, thermal_figure
from allanite.page.shown.two_steps import two_models_figure
from allanite.plots.axes import linear_axis, log_axis, score_axis
from allanite.plots.curves import (
    SINGLE,
    allan_panels,
    component_styles,
    interval,
    missing_lines,
    ordinates_between,
    residuals_between,
    spectrum_panels,
    spectrum_spans,
    tau_spans,
)
from allanite.plots.deviation import plot_deviation
from allanite.plots.recording import column_panel, samples_panel, signal_line
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Axis, Band, Figure, Line, Mark, Panel, Points, Rule, Span
from allanite.plots.themes import COMPONENTS, LOGS
from allanite.plots.time import failing_range_panel, plot_time
from allanite.plots.words import effect_text, unit_text, values_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.page.work import Work
    from allanite.recording import Recording
    from allanite.statespace.filtering import Innovations
    from allanite.statespace.growth import Growth
#: Maximum number of points for single ordinates in a zoomed range.
MAX_ZOOMED = 1500
#: Maximum number of filtered samples; of a longer record only the first ones are used.
MAX_FILTERED = 1_000_000
#: Innovations whose p-value of whiteness is smaller are called correlated. The false-alarm probability is that of
#: `max_outside_by_chance`.
MIN_WHITENESS = 0.01
#: Number of segments of the envelope of the samples, more than a screen can resolve.
SEGMENTS = 1600
#: Maximum number of samples that are drawn individually.
MAX_SINGLE = 3000
#: Maximum number of samples that are marked by points.
MAX_DOTS = 300


def figure_of(tab: Tab, name: str, options: Mapping[str, str] | None = None) -> Figure:
    """`Figure` of a view in the displayed units, with the colors that effects have on this page.

    Raises `InputError` for an unknown view, or if the view needs a fit or check that does not exist yet.
    """
    if name not in VIEWS:
        raise InputError(f"Unknown view {name[:40]!r}: one of {', '.join(VIEWS)}")
    with requested_units(chosen_units(tab.log.unit, tab.unit)):
        figure: Figure = in_figure_units(VIEWS[name](tab, options or {}))
        fit = displayed_fit(tab)
        return figure if fit is None else _with_effect_colors(figure, tab.work, fit)


def _with_effect_colors(figure: Figure, work: Work, fit: Fit) -> Figure:
    """Copy of a figure with the colors of this page for lines and rules whose label is that of an effect of the fit."""
    colors = effect_colors(work, fit)
    roles = {part.label: colors[part.place] for part in component_styles(fit)}

    def with_effect_color(mark: Mark) -> Mark:
        """Copy of a line or rule of an effect in the color that the effect has on this page; other marks unchanged."""
        if isinstance(mark, Line | Rule) and mark.label in roles:
            return replace(mark, color=roles[mark.label])
        return mark

    panels = tuple(replace(p, marks=tuple(map(with_effect_color, p.marks))) for p in figure.panels)
    return replace(figure, panels=panels)


def displayed_fit(tab: Tab) -> Fit | None:
    """`Fit` that is displayed: the model with trial values, or else that of the current step; None without a step."""
    step = tab.column_steps.step
    return tab.preview or (None if step is None else step.fit)


def effect_colors(work: Work, fit: Fit) -> list[str]:
    """Color roles (`COMPONENTS`) of the effects of a model; `work.colors` keeps the color of each in all models."""
    out, seen = [], dict[str, int]()
    for effect in fit.model.effects:
        seen[effect.kind] = seen.get(effect.kind, 0) + 1
        key = (effect.kind, seen[effect.kind])
        place = work.colors.setdefault(key, len(work.colors))
        out.append(COMPONENTS[place % len(COMPONENTS)])
    return out


def _allan_figure(tab: Tab, options: Mapping[str, str]) -> Figure:
    """`Figure` of the Allan deviation with the model and the residuals, or of another deviation that the options name."""
    fit = displayed_fit(tab)
    other = deviation_figure(tab.log, fit, options, tab.work.deviations)
    if other is not None:
        return other
    if fit is None:
        # Before the first fit only the measured curve is available.
        figure = plot_deviation(tab.log.oadev())
        (panel,) = figure.panels
        return replace(
            figure, panels=(replace(panel, y=deviation_axis(figure_unit(tab.log.unit), panel.y)),)
        )
    panels = allan_panels(fit, tau_spans(fit))
    return Figure("Allan deviation", f"model {fit.model.name}", panels, (3.0, 1.0), kind="fit")


def _psd_figure(tab: Tab, options: Mapping[str, str]) -> Figure:
    """`Figure` of the spectrum with the model (with trial values, if any), and of the residuals in σ below.

    Options ``from`` and ``to`` (Hz) add single ordinates. If the model fails in a range narrower than an octave, a map
    of the power in this range over time is beside it.
    """
    fit = displayed_fit(tab) or tab.step.fit
    check = tab.step.check if tab.preview is None else None
    spans = spectrum_spans(fit, None if check is None else check.where.worst_frequency)
    panels = spectrum_panels(fit, 0, spans, missing_lines(check))
    if options.get("from") and options.get("to"):
        panels = _zoomed_panels(fit, panels, options)
    widths: tuple[float, ...] = (1.0,)
    close = None if check is None else _close_up(check)
    if close is not None:
        # A spectrum does not show whether a line drifts, so power over time is drawn beside it.
        title = f"{number(close.y.low, 3)}–{number(close.y.high, 3)} Hz over time"
        panels = (*panels, replace(close, column=1, rows=2, title=title))
        widths = (1.6, 1.0)
    return Figure(
        "Power spectral density, two-sided",
        f"model {fit.model.name}",
        panels,
        (3.0, 1.0),
        widths,
        kind="fit",
    )


_close_up = lru_cache(maxsize=4)(failing_range_panel)


def _zoomed_panels(
    fit: Fit, panels: tuple[Panel, ...], options: Mapping[str, str]
) -> tuple[Panel, ...]:
    """Copies of the spectrum panel and its residual panel with the single ordinates between ``from`` and ``to`` (Hz)."""
    low, high = _positive_option(options, "from", 1.0), _positive_option(options, "to", 1.0)
    spectrum, strip = panels
    f, power = ordinates_between(fit, low, high, most=MAX_ZOOMED)
    marks = [m for m in spectrum.marks if not (isinstance(m, Line) and m.label == SINGLE)]
    at = next(i for i, m in enumerate(marks) if not isinstance(m, Span))
    marks.insert(at, Line(f, power, "raw", SINGLE, 1.0))
    f, z = residuals_between(fit, low, high, most=MAX_ZOOMED)
    shown = score_axis(strip.y.label, z, *(m.y for m in strip.marks if isinstance(m, Points)))
    singles = Points(f, z, "raw", SINGLE, size=3.0)
    return (
        replace(spectrum, marks=tuple(marks)),
        replace(strip, y=shown, marks=(*strip.marks, singles)),
    )


def _map_figure(tab: Tab, _: Mapping[str, str]) -> Figure:
    """`Figure` of a color map of measured over expected power, by time and octave of frequency.

    A second map below shows only the frequency range that the model fits worst. It is left out if `failing_range_panel`
    returns None, or if the record is too short. Raises `InputError` before the check is finished.
    """
    check = tab.step.check
    if check is None:
        raise InputError("The map is being computed …")
    figure = plot_time(check)
    said = [text for view, _, text in check.where.failures() if view == "time"]
    if not check.where.time:
        return figure
    calm = "the noise is constant over the record: no cell differs significantly"
    figure = replace(figure, subtitle="\n".join([*(said or [calm]), figure.subtitle]))
    close = _close_up(check)
    if close is None:
        return figure
    octaves = replace(figure.panels[0], x=close.x, show_x=False)
    panels = (octaves, replace(close, row=1))
    low, high = close.y.low, close.y.high
    told = f"{figure.subtitle}; the lower map shows the range around {0.5 * (low + high):.3g} Hz"
    return replace(figure, panels=panels, heights=(1.0, 1.0), subtitle=told)


def _samples_view(tab: Tab, options: Mapping[str, str]) -> Figure:
    """`Figure` of the samples over time, with events, excluded segments, and the sum of the known functions without lines.

    If the first missing effect follows a logged column, its function is part of the sum, except with trial values.
    """
    step = tab.column_steps.step
    worst = None if step is None or step.check is None else step.check.where.worst_time
    fit = displayed_fit(tab)
    moments = []
    if fit is not None:
        moments = [(e.when[0], fit.display_name(e)) for e in fit.model if e.when is not None]
    span, out = tab.work.part
    begin = 0.0 if span is None else span[0]
    shifted = [(a - begin, b - begin) for a, b in out]
    known = [] if fit is None else [e for e in fit.model.deterministic if e.occupies is None]
    check = None if step is None or tab.preview is not None else step.check
    known += [
        s.effect
        for s in (() if check is None else check.significant[:1])
        if s.effect.follows and isinstance(s.effect, Deterministic)
    ]
    drift = None
    if fit is not None and known and has_all_ordinates(fit.data):
        names = ", ".join(effect_text(fit, e) for e in known)
        drift = fit.data.signal(known), f"explained by {names}"
    figure = samples_figure(tab.log, options, worst, moments, shifted, drift)
    first = check.significant[0] if check is not None and check.significant else None
    if fit is None or first is None or not first.effect.follows:
        return figure
    said = (
        f"{effect_text(fit, first.effect)} {first.removes_text}:"
        f" {values_text(first.effect, first.estimates)}"
    )
    return replace(figure, subtitle=f"{said}\n{figure.subtitle}")


def samples_figure(
    log: Recording,
    options: Mapping[str, str],
    worst: tuple[float, float] | None,
    moments: Sequence[tuple[float, str]] = (),
    out: Sequence[tuple[float, float]] = (),
    drift: tuple[np.ndarray, str] | None = None,
) -> Figure:
    """`Figure` of the samples from ``options["from"]`` to ``options["to"]`` in s, with up to two logged columns below.

    Over 3000 samples are drawn as mean and range of 1600 segments. `worst` is the time range in s in which the model
    fails, `moments` are times of events with names, `out` the excluded segments, `drift` known functions of time and
    their names.
    """
    start, end = _time_range(log, options)
    first, last = int(start * log.rate), min(log.n, int(np.ceil(end * log.rate)) + 1)
    first, last = max(0, min(first, log.n - 4)), max(last, first + 4)
    part = log if last - first >= log.n else log.trim(first / log.rate, last / log.rate)
    size, name = time_scale(part.duration)
    begin = first / log.rate / size
    single = part.n <= MAX_SINGLE
    panel = samples_panel(part, segments=part.n if single else SEGMENTS)
    marks: list[Mark] = []
    if worst is not None and worst[1] > start and worst[0] < end:
        span = max(worst[0], start) / size, min(worst[1], end) / size
        marks.append(Span(*span, "fail", "when the model fails"))
    marks += [
        Span(max(a, start) / size, min(b, end) / size, "raw", "excluded")
        for a, b in out
        if b > start and a < end
    ]
    marks += [_shifted_mark(mark, begin) for mark in panel.marks]
    if part.n <= MAX_DOTS:
        line = next(m for m in marks if isinstance(m, Line))
        marks.append(Points(line.x, line.y, "c1", "single samples", size=3.5))
    if drift is not None:
        marks.append(signal_line(log, *drift, first, part.n))
    marks += [Rule(t / size, "x", "model", "dash", n) for t, n in moments if start <= t <= end]
    limits = (begin, begin + part.duration / size)
    x = linear_axis(f"time ({name})", *limits, 8)
    panels = [replace(panel, x=x, marks=tuple(marks), show_x=not part.covariates)]
    kept = list(part.covariates.items())[:2]
    for row, (column, values) in enumerate(kept, 1):
        panels.append(column_panel(part, column, values, x, row, row == len(kept), begin))
    each = part.n / SEGMENTS
    what = "all drawn" if single else f"mean, minimum and maximum of {each:.0f} samples each"
    heights = (2.0, *(1.0 for _ in kept))
    told = f"{count_text(part.n)} samples, {what}"
    return Figure("Samples", told, tuple(panels), heights, kind="samples")


def _time_range(log: Recording, options: Mapping[str, str]) -> tuple[float, float]:
    """Pair (start, end) of the options in s, limited to the record; by default all of it.

    Raises `InputError` if an option is no number, or if the range is empty.
    """
    try:
        start = float(options.get("from") or 0.0)
        end = float(options.get("to") or log.duration)
    except ValueError:
        raise InputError("A time range needs two numbers, in seconds") from None
    start, end = max(0.0, start), min(log.duration, end)
    if not end > start:
        raise InputError("This time range contains no samples")
    return start, end


def _shifted_mark(mark: Mark, by: float) -> Mark:
    """Copy of a band, line or points shifted along the time axis; other marks unchanged."""
    return replace(mark, x=mark.x + by) if isinstance(mark, Band | Line | Points) else mark


def _compare_figure(tab: Tab, _: Mapping[str, str]) -> Figure:
    """`Figure` of the tab Compare: two steps if the user compares them, otherwise several Allan deviations.

    Other columns of the log appear only if they have the same unit and no other log is compared. The subtitle names
    curves that are not drawn.
    """
    from allanite.comparison import Drawn, compare
    from allanite.plots import plot_compare

    if tab.compared_step is not None:
        return two_models_figure(tab.column_steps, tab.compared_step)
    log, whole = tab.log, tab.work.recording
    items: list[Any] = [(f"{log.columns[0]}, measured", log, None)]
    # The same axis first, then the same kind of sensor, since not all curves may be shown.
    kind = parse_unit(log.unit).kind
    items += [
        (name, other, None)
        for name, other in sorted(
            tab.others,
            key=lambda one: (parse_unit(one[1].unit).kind != kind, one[1].columns != log.columns),
        )
    ]
    missing = []
    if not tab.others:
        apart = [name for name, u in zip(whole.columns, whole.units, strict=True) if u != log.unit]
        if apart:
            missing.append(f"{', '.join(apart)} (another unit)")
        same = [i for i, u in enumerate(whole.units) if u == log.unit and i != tab.column]
        items += [(whole.columns[i], tab.work.log(i), None) for i in same]
    drawn, more = items[: len(LOGS)], [name for name, _, _ in items[len(LOGS) :]]
    found = compare(drawn)
    curves = list(found.curves)
    if tab.column_steps.steps:
        simulated = compare([("Simulated sensor", simulated_sensor(tab.step.fit), None)]).curves[0]
        curves.append(replace(simulated, kind="simulated", low=None, high=None))
    for figure in () if tab.sheet is None else tab.sheet.figures:
        try:
            line = limit_line(figure, log.unit, curves[0].tau)
        except InputError:
            line = None
        name = f"{tab.sheet.name}: {figure.name.replace('_', ' ')}" if tab.sheet else ""
        if line is None:
            missing.append(f"{figure.name.replace('_', ' ')} (no figure of {kind})")
        else:
            curves.append(Drawn(name, "datasheet", log.unit, *line))
    left = ([f"{', '.join(more)} (too many curves)"] if more else []) + missing
    subtitle = f"not shown: {'; '.join(left)}" if left else ""
    return replace(plot_compare(tuple(curves)), subtitle=subtitle)


def _error_figure(tab: Tab, options: Mapping[str, str]) -> Figure:
    """`Figure` of the error of the integrated samples (such as angle or velocity) over the time since the last fix.

    Measured errors have 95 % intervals; they are left out if the record is too short. Options in s: ``aided``, over
    which the bias was averaged before the fix (60 s, at most 1/40 of the record), and ``until`` (600 s, at most 1/10).
    """
    from allanite.statespace.growth import error_growth, measured_growth

    fit = tab.step.fit
    span = tab.log.duration
    aided = _positive_option(options, "aided", min(60.0, span / 40.0))
    until = _positive_option(options, "until", min(600.0, span / 10.0))
    tau = np.geomspace(max(1.0 / tab.log.rate, until / 300.0), until, 13)
    panels, said, apart = [], [], []
    found = error_growth(fit, aided=aided, tau=tau)
    for i, growth in enumerate(found):
        unit, factor = growth.display_unit
        total = factor * growth.total
        marks = _error_lines(growth, fit, effect_colors(tab.work, fit), labeled=i == 0)
        measured: NDArray[np.float64] | tuple[()] = ()
        try:
            seen = measured_growth(tab.log, growth)
        except TooShortError:
            pass
        else:
            fewest, most = int(seen.segments.min()), int(seen.segments.max())
            count = f"{fewest} to {most} segments" if fewest < most else f"{most} segments"
            words = f"Measured ± 95 %, {count if most > 1 else '1 segment'}"
            measured = factor * seen.rms
            low, high = interval(measured, seen.segments.astype(float))
            marks.append(Points(seen.tau, measured, "measured", "" if i else words, low, high))
            apart.append(_disagreement_text(seen.tau, total, low, high))
        name = unit_text(unit)
        noun, _, cause = growth.quantity.partition(" ")
        shown = f"{number(float(total[-1]), 2)}{'' if name == '°' else ' '}{name}"
        said.append(f"the {noun} error {cause}{' ' if cause else ''}{'' if i else 'is '}{shown}")
        x = log_axis("time without a fix (s)", growth.tau)
        y = log_axis(f"error, {growth.quantity} ({name})", total, 0.1 * total, measured)
        panels.append(Panel(x, y, tuple(marks), 0, i, title=growth.quantity.capitalize()))
    left = {name for g in found for name in g.left_out}
    without = f"; without {', '.join(sorted(left))}" if left else ""
    told = f"standard deviations; the bias was averaged over {aided:.3g} s before the fix{without}"
    widths = (1.0,) * len(panels)
    after = f"after {duration_text(until)} without a fix, {', '.join(said)}"
    verdict = next((v for v in apart if v), "the measured errors agree" if apart else "")
    headline = f"{after}: {verdict}" if verdict else after
    return Figure(
        "Error since the last fix",
        f"{headline}\n{told}",
        tuple(panels),
        (1.0,),
        widths,
        kind="error",
    )


def _error_lines(growth: Growth, fit: Fit, colors: Sequence[str], *, labeled: bool) -> list[Mark]:
    """Lines of the error of each effect and of the whole model over the time since the last fix (s).

    Errors are in ``growth.display_unit``. An effect that was not detected is dashed and at its 95 % limit, or left out
    if its fitted value is 0.
    """
    known = dict(zip((e.short for e in fit.model), colors, strict=True))
    limits = {fit.model.effects[p.place].short: p.limit for p in component_styles(fit)}
    estimates = zip(fit.model, fit.estimates, strict=True)
    fitted = {e.short: v[e.coefficient] for e, v in estimates if isinstance(e, Stochastic)}
    _, factor = growth.display_unit
    lines: list[Mark] = []
    for name, error in growth.budget.items():
        short = name.rstrip("0123456789")
        limit = limits.get(short)
        size = factor * error
        if limit is not None:
            if not fitted[short]:
                continue  # without a fitted value, the error at the limit is not known
            # The error is proportional to the coefficient.
            size = size * limit / fitted[short]
        label = name if limit is None else f"{name} (95 % limit)"
        color, dash = known.get(short, "raw"), "solid" if limit is None else "dash"
        lines.append(Line(growth.tau, size, color, label if labeled else "", 1.2, dash))
    total = "Model, total" if labeled else ""
    lines.append(Line(growth.tau, factor * growth.total, "model", total, 2.2))
    return lines


def _disagreement_text(
    tau: NDArray[np.float64],
    total: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> str:
    """Text ``the measured errors are larger from 30 s on``, or ``smaller``; empty if they agree with the model.

    `total` is the error of the model at each `tau` (s), `low` and `high` the 95 % interval of the measured one.
    """
    over, under = low > total, high < total
    out = over | under
    if np.count_nonzero(out) <= max_outside_by_chance(int(np.isfinite(low).sum())):
        return ""
    first = int(np.flatnonzero(out)[0])
    way = "larger" if over[first] else "smaller"
    return f"the measured errors are {way} from {number(float(tau[first]), 2)} s on"


def max_outside_by_chance(points: int) -> int:
    """Largest number of independent points outside their 95 % intervals; more have a probability below 1 %."""
    from scipy.stats import binom

    return int(binom.ppf(0.99, points, 0.05))


def _positive_option(options: Mapping[str, str], name: str, otherwise: float) -> float:
    """Positive float below 1e9 that `options` has under `name`; `otherwise` if it is missing or empty.

    Raises `InputError` for any other number or text.
    """
    try:
        value = float(options.get(name) or otherwise)
    except ValueError:
        value = -1.0
    if not 0.0 < value < 1e9:
        raise InputError(f"{options.get(name, '')[:20]!r} is not a positive number")
    return value


@lru_cache(maxsize=4)
def _filter_innovations(fit: Fit) -> Innovations:
    """`Innovations` of the Kalman filter of a fit, over at most the first million samples; cached."""
    from allanite.statespace import innovations

    log = fit.recording.recording()
    part = log if log.n <= MAX_FILTERED else log.trim(0.0, MAX_FILTERED / log.rate)
    return innovations(part, fit)


def _nis_figure(tab: Tab, _: Mapping[str, str]) -> Figure:
    """`Figure` of the normalized innovation squared of the model's Kalman filter, averaged over τ, with its 95 % band."""
    found = _filter_innovations(tab.step.fit)
    by_tau = found.by_tau
    marks: tuple[Mark, ...] = (
        Band(by_tau.tau, by_tau.low, by_tau.high, "model", "95 % if the filter is consistent"),
        Rule(1.0, "y", "guide", "solid"),
        Points(by_tau.tau, by_tau.nis, "measured", "Measured"),
    )
    x: Axis = log_axis("innovations averaged over τ (s)", by_tau.tau)
    values = np.concatenate([by_tau.nis, by_tau.low, by_tau.high])
    y = (
        log_axis("NIS", values)
        if values.max() > 5.0
        else linear_axis("NIS", 0.0, 1.1 * float(values.max()))
    )
    first = "the first " if found.recording.n < tab.log.n else ""
    states = f"{found.space.states} state" + ("s" if found.space.states != 1 else "")
    told = (
        f"{first}{count_text(found.n)} innovations, {states}: mean NIS {found.mean_nis:.4g},"
        f" {number(100 * found.coverage)} % below the 95 % point, whiteness {p_text(found.whiteness)}"
    )
    verdict = _consistency_sentence(
        by_tau.tau, by_tau.nis, by_tau.low, by_tau.high, found.whiteness
    )
    told = f"{verdict}\n{told}"
    panel = Panel(x, y, marks, title="NIS")
    return Figure("Normalized innovation squared (NIS)", told, (panel,), kind="nis")


def _consistency_sentence(
    tau: NDArray[np.float64],
    nis: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    whiteness: float,
) -> str:
    """Sentence on whether the errors of a filter are as large as the filter expects, and uncorrelated.

    `nis` is the normalized innovation squared at each `tau` (s), `low` and `high` its 95 % interval for a consistent
    filter. A `whiteness` (p-value) below 0.01 means correlated.
    """
    over, under = nis > high, nis < low
    count, points = int(np.count_nonzero(over | under)), nis.size
    outside = f"{count} of {points} points lie outside the 95 % interval"
    if count <= max_outside_by_chance(points) and whiteness < MIN_WHITENESS:
        return (
            f"the errors are as large as the filter expects ({outside}), but they are correlated:"
            f" {p_text(whiteness)}"
        )
    if count <= max_outside_by_chance(points):
        return f"the filter is consistent with the record: {outside}"
    kind, which = (
        ("overconfident", over) if over.sum() >= under.sum() else ("too conservative", under)
    )
    at = np.flatnonzero(which)
    worst = at[np.abs(np.log(nis[at])).argmax()]
    return (
        f"the filter is {kind}: at τ = {number(float(tau[worst]), 2)} s its squared errors are"
        f" {number(float(nis[worst]), 2)} × what it expects; {outside}"
    )


VIEWS = {
    "allan": _allan_figure,
    "psd": _psd_figure,
    "map": _map_figure,
    "samples": _samples_view,
    "compare": _compare_figure,
    "error": _error_figure,
    "nis": _nis_figure,
    "thermal": thermal_figure,
    "average": average_figure,
}

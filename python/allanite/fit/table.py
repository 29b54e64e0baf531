"""Text table and sentences of a fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.numbers import (
    harmonics_text,
    number,
    numbers_text,
    p_text,
    value_and_interval_text,
    value_and_interval_texts,
)
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines, heading
from allanite.common.units import coefficient_unit, conversion
from allanite.effects.sheet_units import in_sheet_unit, sheet_unit
from allanite.fit.measures import MIN_ADEQUATE_P
from allanite.fit.models import parameter_label

if TYPE_CHECKING:
    from allanite.effects import Parameter
    from allanite.fit.result import Fit
    from allanite.fit.rivals.undecided import Undecided

#: Minimum distance by which an end of an averaged interval must lie farther out for the interval to be reported, as a
#: fraction of the width of the fit's interval. Chosen by judgment; not measured.
MIN_WIDER_FRACTION = 0.1
#: Maximum number of alternative models named in a sentence. Chosen by judgment; not measured.
MAX_NAMED_MODELS = 3
#: Probability of the chosen model below which the sentence says that the record prefers others: the usual 5 %.
MIN_CHOSEN_PROBABILITY = 0.05


def method_text(fit: Fit) -> str:
    """Text such as ``, fitted to the Allan curve`` for the methods gls and lines; empty for a Whittle fit."""
    return {
        "gls": ", fitted to the Allan curve",
        "lines": ", straight lines on the Allan curve",
    }.get(fit.method, "")


def parameter_rows(fit: Fit) -> list[tuple[str, str, str, str]]:
    """List of table rows (effect, parameter, value, 95 % interval) of all parameters that have a value, as text.

    The effect is named in its first row only. For a parameter that the fit kept, ``held`` or ``at its limit`` replaces the
    interval.
    """
    rows = []
    for effect, values in zip(fit.model.effects, fit.estimates, strict=True):
        title = fit.display_name(effect)
        for name, value in values.items():
            if value is None:
                continue
            declared = effect.parameter(name)
            if isinstance(value, Estimate):
                value = in_sheet_unit(value, declared)
            if isinstance(value, tuple) and name == "overtones":
                unit, factor = _unit_and_factor(effect.parameter("amplitude"), fit.recording.unit)
                value = harmonics_text(float(values["frequency"]), value, unit, factor)
            elif isinstance(value, tuple):
                unit, factor = _unit_and_factor(declared, fit.recording.unit)
                shown = [factor * v for v in value]
                value = f"{numbers_text(shown, times=declared.role == 'time')} {unit}".rstrip()
            number, interval = _cells(value, effect.follows)
            rows.append((title, name, number, effect.kept(name) or interval))
            title = ""
    return rows


def _unit_and_factor(parameter: Parameter, sample: str) -> tuple[str, float]:
    """Pair: printed unit of a parameter, empty for a pure number, and the factor of its value; samples are in `sample`."""
    unit, factor = sheet_unit(parameter, sample), 1.0
    if isinstance(parameter.unit, float):
        factor = conversion(coefficient_unit(sample, parameter.unit), unit)
    return "" if unit == "1" else printed(unit), factor


def estimate_cell(estimate: Estimate) -> str:
    """Table cell, without unit: value with 95 % interval if any, ``< limit``, or ``not detected`` without a limit."""
    if not estimate.detected:
        return "not detected" if estimate.interval is None else f"< {number(estimate.limit)}"
    if estimate.interval is None:
        return number(float(estimate), 4)
    return value_and_interval_text(float(estimate), estimate.interval)


def _cells(value: Any, column: str | None) -> tuple[str, str]:
    """Pair of texts: value and 95 % interval of a parameter. The interval is "" if there is none.

    A coefficient that is not detected gives "not detected" and "< " with the upper limit and unit, or "not present" and ""
    without a limit. A value that is no `Estimate` is shown as it is. `column` is the logged column that the effect follows,
    for the unit.
    """
    if not isinstance(value, Estimate):
        return str(value), ""
    unit = "" if value.unit == "1" else printed(value.unit, column or "")
    if not value.detected and value.interval is not None:
        return "not detected", f"< {number(value.limit, 3)} {unit}".rstrip()
    if not value.detected:
        return "not present", ""
    if value.interval is None:
        return f"{number(float(value), 4)} {unit}".rstrip(), ""
    text, low, high = value_and_interval_texts(float(value), value.interval)
    return f"{text} {unit}".rstrip(), f"{low} … {high}"


def misfit_line(fit: Fit, whole: bool = True) -> str:
    """Sentence on the agreement of a fit: χ², adequacy, Allan error, discrepancy, and ignored bands.

    Parts without a value are left out. Without `whole`, an adequate fit is described as "not rejected by χ² alone", because
    other checks failed.
    """
    m, e = fit.misfit, fit.error
    words = (
        ("adequate" if whole else "not rejected by χ² alone") if fit.adequate else "not adequate"
    )
    if not fit.adequate:
        words += _reason(fit)
    if fit.adequate and fit.limited_by_quantization:
        words += ", limited by quantization"
    # Several tests share a false-alarm probability of 1 %. A p-value between its part and 1 % looks like a rejection.
    limit = f" (limit {MIN_ADEQUATE_P})" if MIN_ADEQUATE_P <= m.p_value < 0.01 else ""
    line = f"χ²/dof = {m.reduced:.2f} ({m.chi2:.0f}/{m.dof}), {p_text(m.p_value)}{limit}: {words}"
    if e.adev_rms_percent is not None and e.chance_rms_percent is not None:
        line += (
            f"; Allan deviation: residual {number(e.adev_rms_percent, 2)} % rms"
            f" (expected scatter: {number(e.chance_rms_percent, 2)} %)"
        )
    if e.adev_worst is not None:
        factor, tau = e.adev_worst
        line += f", largest error at τ = {number(tau)} s: model/measured = {number(factor)}"
    if fit.discrepancy.percent:
        off = fit.discrepancy.percent
        # δ is the typical error; a few bins may be off by far more.
        line += f"; most of the spectrum is within {off:.{2 if off < 99.5 else 3}g} % of the model"
    if fit.not_judged:
        where = " and ".join(f"{low:.3g}–{high:.3g}" for low, high in fit.not_judged)
        line += f"; not judged: {where} Hz, where a filter removed more than 99.99 % of the power"
    return line


def _reason(fit: Fit) -> str:
    """Text in parentheses, with a leading blank: why a fit is not adequate although its χ² is not too large, or ""."""
    if fit.misfit.is_too_small:
        return " (χ² is smaller than that of noise)"
    if fit.misfit.p_value < MIN_ADEQUATE_P:
        return ""
    if fit.solution.discrepancy:
        return " (only with a model discrepancy)"
    what = "dead zone or dead band" if fit.distortion else "the Allan deviation contradicts it"
    return f" ({what})"


def _percent(share: float) -> str:
    """Text of a probability `share` in percent, two digits; "100 %" above 99.5 %."""
    return "100 %" if share > 0.995 else f"{number(100.0 * share, 2)} %"


def is_wider(value: Estimate, interval: tuple[float, float]) -> bool:
    """True if an end of `interval` lies outside the interval of the estimate by more than 10 % of its width.

    False if the estimate has no interval.
    """
    if value.interval is None:
        return False
    low, high = value.interval
    return max(low - interval[0], interval[1] - high) > MIN_WIDER_FRACTION * (high - low)


def undecided_sentence(fit: Fit, found: Undecided) -> str:
    """Sentence that names up to three other models that explain the record equally well, and the widened intervals.

    Only intervals that are clearly wider (`is_wider`) are given. Below a probability of 5 % of the fitted model, the
    sentence says that the record favors the others.
    """
    (own, share), *others = found.models
    others = sorted(others, key=lambda model: -model[1])
    names = ", ".join(f"{name} ({_percent(p)})" for name, p in others[:MAX_NAMED_MODELS])
    if len(others) > MAX_NAMED_MODELS:
        names += f" and {len(others) - MAX_NAMED_MODELS} more"
    sentence = f"this record cannot distinguish {own} ({_percent(share)}) from {names}"
    if share < MIN_CHOSEN_PROBABILITY:
        sentence = f"the record favors {names} over {own} ({_percent(share)})"
    wider = []
    every = zip(fit.model.effects, fit.model.labels, fit.estimates, found.intervals, strict=True)
    for effect, label, values, intervals in every:
        for name, (low, high) in intervals.items():
            value = values[name]
            if not is_wider(value, (low, high)):
                continue
            over = Estimate(value, None, (low, high), value.unit, True, name)
            declared = effect.parameter(name)
            over = in_sheet_unit(over, declared)
            unit = "" if over.unit == "1" else printed(over.unit, effect.follows or "")
            short = parameter_label(label, name)
            if low == high == 0.0:
                wider.append(f"no {short}")
                continue
            wider.append(f"{short} {_cells(over, effect.follows)[1]} {unit}".rstrip())
    return f"{sentence}; over all of them {', '.join(wider)}" if wider else sentence


#: Warning below the table of a fit that is not adequate.
NOT_ADEQUATE_WARNING = "! do not use these limits and intervals: the model does not fit"


def alternative_texts(fit: Fit, found: Undecided | None) -> list[str]:
    """List of a text for each effect of a fit: what may replace the effect, and the odds; ``""`` if nothing may.

    For example ``not needed in a model with rate ramp (62 : 38)``.
    """
    texts = []
    for either in (None,) * len(fit.model) if found is None else found.instead:
        text = ""
        if either is not None:
            new, share = either
            odds = f"({100.0 * (1.0 - share):.0f} : {100.0 * share:.0f})"
            names = " and ".join(dict.fromkeys(map(fit.display_name, new)))
            text = f"not needed in a model with {names} {odds}" if names else f"not needed {odds}"
        texts.append(text)
    return texts


def fit_table(
    fit: Fit,
    remedy: str = "; run `allanite improve`",
    whole: bool = True,
    over: Undecided | None = None,
) -> str:
    """Text table of a fit: recording, parameters with intervals, agreement, and warnings.

    `remedy` is added to the warning if the fit is not adequate; `whole` is as of `misfit_line`. With `over`, the first row
    of each effect names what may replace it.
    """
    r = fit.recording
    lines = [heading(r), f"model {fit.model.name}{method_text(fit)}", ""]
    others = iter(alternative_texts(fit, over))
    rows = [(*row, next(others) if row[0] else "") for row in parameter_rows(fit)]
    lines += [f"  {line}" for line in aligned_lines(rows)]
    wrong = [] if fit.adequate else [NOT_ADEQUATE_WARNING + remedy]
    doubts = [f"! {s}" for s in fit.degeneracies]
    return "\n".join([*lines, "", misfit_line(fit, whole), *wrong, *doubts])

"""Records for the panels beside the curves: effects of the model, suggested effects, and steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import (
    duration_text,
    number,
    p_text,
    value_and_interval_texts,
    with_readable_numbers,
)
from allanite.common.parameters import Estimate
from allanite.criticism import over_time
from allanite.criticism.verdict import MIN_INTERVAL_SCORE
from allanite.effects import Deterministic, Effect, find, limitable
from allanite.fit.curve import MIN_FAILING_SCORE
from allanite.fit.table import is_wider, undecided_sentence
from allanite.page.edits import factor_of, shown_unit
from allanite.plots.curves import component_styles
from allanite.plots.words import effect_text, with_unit
from allanite.study import misfit_left
from allanite.suggestion.explanation import name_with_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit import Fit
    from allanite.fit.rivals.undecided import Undecided
    from allanite.page.work import Step
    from allanite.study import Study
    from allanite.suggestion import Check, Suggestion

#: View that shows a failure over τ, frequency or time.
SHOWS = {"tau": "allan", "frequency": "psd", "time": "map"}
#: A process at frequency f affects the Allan curve most at τ = PEAK / f (peak of the transfer function).
PEAK = 0.37
#: A range of frequencies below this, in Hz, is written as periods; chosen by judgment.
SLOW = 0.01
#: Range of the spectrum that is shown at least on each side of a line, relative to its frequency.
MIN_SHOWN_WIDTH = 0.005


def chips(
    fit: Fit, unit: str | None = None, colors: Sequence[str] = (), found: Undecided | None = None
) -> list[dict[str, Any]]:
    """List of one dict per effect of the model: place, kind, names, physics, color, label, and values with intervals.

    Values are displayed in units made of the sample unit `unit`; `SHEET` stands for data-sheet units, None for the
    recording's unit. Color (a role of `colors`) and label are None for an effect that figures do not draw. An interval
    over the equally good models `found` is added if it is wider.
    """
    drawn = {part.place: part for part in component_styles(fit)}
    out = []
    for place, (effect, values) in enumerate(zip(fit.model.effects, fit.estimates, strict=True)):
        part = drawn.get(place)
        out.append(
            {
                "place": place,
                "kind": effect.kind,
                "short": effect.short,
                "name": effect_text(fit, effect),
                "physics": fit.text_of(effect, "physics"),
                "single": type(effect).single,
                "color": None if part is None else colors[place] if colors else part.color,
                "label": None if part is None else part.label,
                "values": [
                    _value_record(
                        effect,
                        name,
                        value,
                        shown_unit(effect.parameter(name), value, fit.recording.unit, unit),
                        None if found is None else found.intervals[place].get(name),
                    )
                    for name, value in values.items()
                    if isinstance(value, Estimate)
                ],
            }
        )
    return out


def failures(study: Study) -> list[dict[str, Any]]:
    """Dicts (text, view, place) of the reasons why a model is not adequate; empty for an adequate study.

    ``view`` is the name of the view that shows the failure, and ``place`` its range there; both are None if no view
    does.
    """
    if study.adequate:
        return []
    check = study.check
    placed = {sentence: (view, place) for view, place, sentence in check.where.failures()}
    out = []
    # Alternative explanations are mentioned only for models without other failures.
    for text in study.doubts if check.adequate else check.left or [check.nowhere]:
        view, place = placed.get(text, (None, None))
        shown = view and SHOWS[view]
        if text == check.nowhere and check.significant:
            # No view fails, so the sentence leads to the figure of the missing effect.
            shown = most_informative_view(study)
        out.append({"text": text, "view": shown, "place": place})
    return out


def most_informative_view(study: Study) -> str:
    """Name of the view that shows best what is missing: ``"allan"``, ``"psd"``, ``"samples"`` or ``"map"``.

    ``"allan"`` for an adequate model. Without a better rule, it is the view in which the model fails most.
    """
    check = study.check
    first = check.significant[0].effect if check.significant else None
    if study.adequate or (first is None and not check.where.fails):
        return "allan"
    if first is not None and first.follows:
        return "samples"
    scores = _largest_scores(study)
    if first is not None and (first.periodic or first.occupies is not None):
        # A line or a band is a clear peak in the spectrum, but only a ripple on the Allan curve.
        return "psd"
    if scores:
        return max(scores, key=lambda view: scores[view])
    assert first is not None
    return "samples" if first.when else "allan"


def _largest_scores(study: Study) -> dict[str, float]:
    """Dict from the name of each view in which the model fails (allan, psd, map) to the size of its failure.

    The size is the largest absolute standard score of the view, divided by the smallest one that counts as a failure.
    """
    where, fit = study.check.where, study.fit
    out = {}
    if where.worst_tau is not None:
        out["allan"] = float(np.nanmax(np.abs(fit.curve.z))) / MIN_FAILING_SCORE
    if where.worst_frequency is not None:
        low, high = fit.data.bins.limits(fit.data.rate)
        inside = (low >= where.worst_frequency[0]) & (high <= where.worst_frequency[1])
        total = abs(float(fit.z[inside].sum())) / np.sqrt(max(1.0, float(inside.sum())))
        out["psd"] = total / MIN_INTERVAL_SCORE
    if where.worst_time is not None:
        out["map"] = max(abs(r["z"]) for r in where.time) / over_time.MIN_CELL_SCORE
    return out


def alternatives_sentence(study: Study) -> str | None:
    """Sentence that names the other models that explain the record equally well, if any; None without an adequate check."""
    if not study.check.adequate:
        return None
    if study.undecided is None:
        return "No other model of the catalog explains this record equally well."
    said = with_readable_numbers(undecided_sentence(study.fit, study.undecided))
    return f"{said[0].upper()}{said[1:]}."


def _interval_over_all_text(own: Estimate, interval: tuple[float, float] | None, shown: str) -> str:
    """Text, in the unit `shown`, of the interval over all equally good models; empty if it is not wider than the own one.

    `interval` is in the unit of `own`.
    """
    if interval is None or not is_wider(own, interval):
        return ""
    over = Estimate(own, None, interval, own.unit, True, own.name).to(shown).interval
    assert over is not None
    return f"{number(over[0], 3)} … {number(over[1], 3)} over all alternatives"


def _value_record(
    effect: Effect,
    name: str,
    own: Estimate,
    shown: str,
    over_all: tuple[float, float] | None,
) -> dict[str, Any]:
    """Dict of one value of an effect, as texts for the page, in the unit `shown`: value, 95 % interval, limits, and flags.

    `over_all` is the interval over all equally good models, in the unit of `own`; None if not known. A value that is
    not detected has the text ``< limit``, except times and frequencies.
    """
    value = own.to(shown)
    role = effect.parameter(name).role
    text, spread = number(value.value), ""
    if not value.detected and value.interval is not None and value.unit not in ("s", "Hz"):
        text = f"< {number(value.limit, 2)}"
        spread = "not detected (95 % limit)"
    elif value.interval is not None:
        text, first, last = value_and_interval_texts(value.value, value.interval)
        spread = f"{first} … {last}"
    return {
        "name": name,
        "symbol": _symbol(effect, name),
        "text": with_unit(text, value.unit),
        "spread": spread,
        "over_all": _interval_over_all_text(own, over_all, shown),
        "number": float(f"{value.value:.6g}"),
        "unit": with_unit("", value.unit).strip(),
        "detected": value.detected,
        "held": name in effect.hold,
        "kept": effect.kept(name),
        "limits": _displayed_limits(effect, name, factor_of(own, shown)),
        "role": role,
        "free": role in ("coefficient", "shape"),
    }


def _displayed_limits(effect: Effect, name: str, factor: float) -> list[float | None] | None:
    """Limits [low, high] of a parameter times `factor`, None for an open end; None if it cannot have limits."""
    if not limitable(effect.parameter(name)):
        return None
    ends = effect.checked_limits.to_dict().get(name, [None, None])
    return [None if end is None else float(f"{end * factor:.6g}") for end in ends]


def cards(check: Check, unit: str | None = None) -> list[dict[str, Any]]:
    """One dict per significant suggestion, at most 8; without any, of the two best suggestions. `unit` as in `chips`."""
    shown = [(i, s) for i, s in enumerate(check.suggestions) if s.significant]
    shown = shown or list(enumerate(check.suggestions))[:2]
    return [_suggestion_record(check.fit, i, s, unit) for i, s in shown[:8]]


def _suggestion_record(fit: Fit, place: int, s: Suggestion, unit: str | None) -> dict[str, Any]:
    """Dict of a suggestion for the page, with values in `unit`; `place` is its index in `Check.suggestions`."""
    rivals = [cls.title for k in s.rivals if (cls := find(k)) is not None]
    chance = p_text(s.p_value, 1)
    name, acts = effect_text(fit, s.effect), _ranges_of_action(fit, s)
    ends = _line_range(fit, s.effect) or acts["frequency"]
    where = _frequency_range_text(ends, fit.data.duration)
    return {
        "number": place,
        "kind": s.kind,
        "name": name,
        "significant": s.significant,
        "values": _values_text(fit, s, unit),
        "sentence": s.explanation.partition(": ")[2],
        "physics": fit.text_of(s.effect, "physics"),
        "confirm": s.check_by,
        "rivals": rivals,
        "evidence_text": f"ΔlogL {number(s.delta_log_likelihood)}, {chance}",
        "size": s.removes_percent / 100.0,
        "size_text": f"{s.removes_text}{where}",
        "acts": acts,
        **_view_and_range(s.effect, ends, acts["time"]),
    }


def _view_and_range(
    effect: Effect, frequency: Sequence[float] | None, time: Sequence[float] | None
) -> dict[str, Any]:
    """Dict with the view that shows a missing effect best, ``samples`` or ``psd``, and with its range there as ``place``.

    `frequency` (Hz) and `time` (s) are the ranges in which the effect acts. ``place`` is None for an effect that
    follows a logged column.
    """
    if effect.follows or effect.when or frequency is None:
        return {"view": "samples", "place": None if effect.follows else time}
    low, high = frequency
    return {"view": "psd", "place": [low * (1 - MIN_SHOWN_WIDTH), high * (1 + MIN_SHOWN_WIDTH)]}


def _values_text(fit: Fit, s: Suggestion, unit: str | None) -> str:
    """Text of the values of a suggestion, e.g. ``f = 38 Hz, a = 2.1 °/h, with harmonics 2, 3``; empty without values."""
    lines = name_with_lines(s.effect, fit).removeprefix(fit.display_name(s.effect))
    texts = []
    for name, own in s.estimates.items():
        if isinstance(own, Estimate):
            value = own.to(shown_unit(s.effect.parameter(name), own, fit.recording.unit, unit))
            text = f"{_symbol(s.effect, name)} = {number(value.value, 3)}"
            texts.append(with_unit(text, value.unit))
    return ", ".join(filter(None, [*texts, lines.lstrip(", ")]))


def _line_range(fit: Fit, effect: Effect) -> tuple[float, float] | None:
    """Pair (lowest, highest) frequency in Hz that a spectral line has during the record; None if the effect is no line."""
    if not isinstance(effect, Deterministic):
        return None
    return effect.seen_between(*fit.data.span) or effect.occupies


def _frequency_range_text(ends: Sequence[float] | None, duration: float) -> str:
    """Text of a frequency range: `` at 38 Hz`` or `` between 1 and 2 Hz``; empty for None.

    A range below 0.01 Hz is written as periods; those that exceed the `duration` (s) of the record have no upper end.
    """
    if ends is None:
        return ""
    if 0.0 < ends[0] < ends[1] < SLOW:
        shortest, longest = (duration_text(1.0 / f) for f in reversed(ends))
        return f" at periods of {shortest} {'or more' if ends[0] * duration < 1.0 else f'to {longest}'}"
    low, high = (number(f, 2) for f in ends)
    return f" at {low} Hz" if low == high else f" between {low} and {high} Hz"


def _symbol(effect: Effect, name: str) -> str:
    """Symbol of a parameter; if it has none, its name with blanks instead of underscores, except ``q_c``, which stays."""
    plain = name if name == "q_c" else name.replace("_", " ")
    return effect.parameter(name).symbol or plain


def _ranges_of_action(fit: Fit, s: Suggestion) -> dict[str, list[float] | None]:
    """Ranges ``tau`` (s), ``frequency`` (Hz) and ``time`` (s), [low, high] or None, in which a suggested effect acts.

    A spectral line has no time, and an event with a duration only its time. Other effects have the frequencies at which
    they change the logarithm of the model's spectrum by over half of the largest change; if they hardly change it, the
    lowest ones.
    """
    out: dict[str, list[float] | None] = {"tau": None, "frequency": None, "time": None}
    rate, span = fit.data.rate, fit.data.duration
    if (ends := _line_range(fit, s.effect)) is not None:
        low, high = ends
        out["frequency"] = [low / 1.12, high * 1.12]
        out["tau"] = [max(1.0 / rate, 0.15 / high), 1.2 / low]
        return out
    if s.effect.when is not None:
        start, end = s.effect.when
        if end > start:
            return {**out, "time": [start, end]}
        out["time"] = [max(0.0, start - 0.01 * span), min(span, end + 0.01 * span)]
    change = np.abs(np.log(s.solution.spectrum / fit.solution.spectrum))
    if change.max() < 1e-6:
        low = fit.data.bins.frequency(rate)[0]
        return {
            **out,
            "frequency": [float(low), 10 * float(low)],
            "tau": [0.03 / float(low), PEAK / float(low)],
        }
    bottom, upper = fit.data.bins.limits(rate)
    inside = np.flatnonzero(change > 0.5 * change.max())
    low, high = max(float(bottom[inside[0]]), 0.5 / span), float(upper[inside[-1]])
    out["frequency"] = [low, high]
    out["tau"] = [max(PEAK / high, 1.0 / rate), max(min(PEAK / low, span / 3.0), 1.5 / rate)]
    return out


def step_rows(steps: tuple[Step, ...]) -> list[dict[str, Any]]:
    """Dicts of `step_row` for the steps of the model building, with ``left`` and ``left_text``.

    ``left`` is the unexplained misfit in % of the largest one, usually that of the first step; 0 for an adequate model.
    """
    left = misfit_left([s.rung for s in steps]) if steps else ()
    left = tuple(
        0.0 if s.study is not None and s.study.adequate else share
        for s, share in zip(steps, left, strict=True)
    )
    return [
        {**step_row(s), "left": share, "left_text": _percent_text(share)}
        for s, share in zip(steps, left, strict=True)
    ]


def step_row(step: Step) -> dict[str, Any]:
    """Dict of one step: label, model, misfit, errors and their texts, and whether the model is adequate.

    Before errors are computed, their texts are ``…`` and ``predictive`` is None. ``adequate`` is None before the check.
    """
    fit, error = step.fit, step.error
    misfit = fit.misfit
    return {
        "label": step.label,
        "model": fit.model.name,
        "chi2": misfit.reduced,
        "chi2_text": number(misfit.reduced),
        "p_text": number(misfit.p_value, 1),
        "error_text": "…" if error is None else _percent_text(error.adev_rms_percent),
        "max_text": "…" if error is None else _worst_ratio_text(error.adev_worst),
        "discrepancy_text": _percent_text(fit.discrepancy.percent),
        "chance_text": "…" if error is None else _percent_text(error.chance_rms_percent),
        "predictive": None if error is None else error.predictive_score,
        "predictive_text": "…" if error is None else _nats_text(error.predictive_score),
        "adequate": None if step.study is None else step.study.adequate,
        "checked": step.study is not None,
    }


def _worst_ratio_text(worst: tuple[float, float] | None) -> str:
    """Text of the largest ratio of model to measured Allan deviation and its τ; a dash without a ratio."""
    return "–" if worst is None else f"×{number(worst[0], 3)} at {number(worst[1], 3)} s"


def _percent_text(value: float | None) -> str:
    """Text of a percentage; a dash for None."""
    return "–" if value is None else f"{number(value, 2)} %"


def _nats_text(value: float | None) -> str:
    """Text of a log-likelihood of unseen data in nats, ``-12.3 nats``; a dash for None."""
    return "–" if value is None else f"{number(value, 4)} nats"

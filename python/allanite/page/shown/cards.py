"""What stands beside the curves: chips of the model, cards of what is missing, rungs of the ladder."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import number
from allanite.common.parameters import Estimate
from allanite.effects import Effect, Periodic, find, limitable
from allanite.page.edits import factor_of, shown_unit
from allanite.plots.curves import parts
from allanite.plots.words import effect_text, unit_text
from allanite.report.words import resolved
from allanite.study import misfit_left

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit import Fit
    from allanite.page.ladder import Step
    from allanite.suggestion import Check, Suggestion

__all__ = ["cards", "chips", "rung", "rungs"]

#: τ at which a process of frequency f shows most on the Allan curve, times f (the transfer function's peak).
PEAK = 0.37


def chips(fit: Fit, unit: str | None = None, colors: Sequence[str] = ()) -> list[dict[str, Any]]:
    """One record an effect of the model: name, colour role, values with units and intervals.

    `unit` is the sample unit in which they are shown, or `SHEET`; None for the recording's. `colors` are the roles of
    the effects, in the order of the model.
    """
    drawn = {part.place: part for part in parts(fit)}
    out = []
    for place, (effect, values) in enumerate(zip(fit.model.effects, fit.estimates, strict=True)):
        part = drawn.get(place)
        out.append(
            {
                "place": place,
                "kind": effect.kind,
                "short": effect.short,
                "name": effect_text(fit, effect),
                "physics": effect.physics,
                "single": type(effect).single,
                "color": None if part is None else colors[place] if colors else part.color,
                "label": None if part is None else part.label,
                "values": [
                    _value(
                        effect,
                        name,
                        value,
                        shown_unit(effect.parameter(name), value, fit.recording.unit, unit),
                    )
                    for name, value in values.items()
                    if isinstance(value, Estimate)
                ],
            }
        )
    return out


def _value(effect: Effect, name: str, own: Estimate, shown: str) -> dict[str, Any]:
    value = own.to(shown)
    unit = "" if value.unit in ("", "1") else " " + unit_text(value.unit)
    role = effect.parameter(name).role
    text = f"{number(value.value)}{unit}"
    spread = ""
    if not value.detected and value.interval is not None and value.unit not in ("s", "Hz"):
        text = f"< {number(value.interval[1], 2)}{unit}"
        spread = "not seen (95 % limit)"
    elif value.interval is not None:
        low, high = value.interval
        found, first, last = resolved((value.value, low, high), (high - low) / 4.0)
        text, spread = f"{found}{unit}", f"{first} … {last}"
    return {
        "name": name,
        "symbol": _symbol(effect, name),
        "text": text,
        "spread": spread,
        "number": float(f"{value.value:.6g}"),
        "unit": unit.strip(),
        "detected": value.detected,
        "held": name in effect.hold,
        "kept": effect.kept(name),
        "limits": _limits(effect, name, factor_of(own, shown)),
        "free": role in ("coefficient", "shape"),
    }


def _limits(effect: Effect, name: str, factor: float) -> list[float | None] | None:
    """The ends between which a number is fitted, None for an open one; None altogether where it can have none."""
    if not limitable(effect.parameter(name)):
        return None
    ends = effect.limits.to_dict().get(name, [None, None])
    return [None if end is None else float(f"{end * factor:.6g}") for end in ends]


def cards(check: Check) -> list[dict[str, Any]]:
    """One record a suggestion, the significant ones and, if there are none, the two best of the rest."""
    shown = [(i, s) for i, s in enumerate(check.suggestions) if s.significant]
    shown = shown or list(enumerate(check.suggestions))[:2]
    top = max([s.delta_log_likelihood for _, s in shown], default=1.0)
    return [_card(check.fit, i, s, top) for i, s in shown[:8]]


def _card(fit: Fit, place: int, s: Suggestion, top: float) -> dict[str, Any]:
    rivals = [cls.title for k in s.rivals if (cls := find(k)) is not None]
    chance = "p < 10⁻⁹⁹" if s.log10_p < -99 else f"p = {number(s.p_value, 1)}"
    return {
        "number": place,
        "kind": s.kind,
        "name": fit.display_name(s.effect),
        "significant": s.significant,
        "sentence": _sentence(s),
        "physics": s.effect.physics,
        "confirm": s.check_by,
        "rivals": rivals,
        "evidence": float(
            np.clip(np.log1p(s.delta_log_likelihood) / np.log1p(max(top, 1e-9)), 0, 1)
        ),
        "evidence_text": f"ΔlogL {number(s.delta_log_likelihood)}, {chance}",
        "size": s.removes_percent / 100.0,
        "size_text": f"{number(s.removes_percent, 2)} % of spectral misfit",
        "size_title": f"Removes {number(s.removes_percent, 2)} % of the spectrum's misfit",
        "acts": _acts(fit, s),
    }


def _sentence(s: Suggestion) -> str:
    """The explanation with parameters and units as they are printed."""
    values = [v for v in s.estimates.values() if isinstance(v, Estimate)]
    text = s.explanation
    # The longest unit first: rad/s is a part of rad/s·s^½.
    for value in sorted(values, key=lambda v: -len(v.unit)):
        text = text.replace(f"{value.name} = ", f"{_symbol(s.effect, value.name)} = ")
        if value.unit:
            text = text.replace(f" {value.unit}", f" {unit_text(value.unit)}")
    return text


def _symbol(effect: Effect, name: str) -> str:
    plain = name if name == "q_c" else name.replace("_", " ")
    return effect.parameter(name).symbol or plain


def _acts(fit: Fit, s: Suggestion) -> dict[str, list[float] | None]:
    """Where an effect would be seen: ranges of τ (s), frequency (Hz) and time (s), None where it has none."""
    out: dict[str, list[float] | None] = {"tau": None, "frequency": None, "time": None}
    rate, span = fit.data.rate, fit.data.duration
    if isinstance(s.effect, Periodic) and s.effect.frequency is not None:
        f = s.effect.frequency
        out["frequency"] = [f / 1.12, f * 1.12]
        out["tau"] = [max(1.0 / rate, 0.15 / f), 1.2 / f]
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


def rungs(steps: tuple[Step, ...]) -> list[dict[str, Any]]:
    """The ladder: what `rung` says of each step, and what it leaves of the first one's misfit."""
    left = misfit_left([s.rung for s in steps]) if steps else ()
    return [
        {**rung(s), "left": share, "left_text": _percent(share)}
        for s, share in zip(steps, left, strict=True)
    ]


def rung(step: Step) -> dict[str, Any]:
    """One record of the ladder: what was done, errors, whether the model is adequate."""
    fit, error = step.fit, step.error
    misfit = fit.misfit
    return {
        "label": step.label,
        "model": fit.model.name,
        "chi2": misfit.reduced,
        "chi2_text": number(misfit.reduced),
        "p_text": number(misfit.p_value, 1),
        "error_text": "…" if error is None else _percent(error.adev_rms_percent),
        "max_text": "…" if error is None else _worst(error.adev_worst),
        "discrepancy_text": _percent(fit.discrepancy.percent),
        "chance_text": "…" if error is None else _percent(error.chance_rms_percent),
        "predictive": None if error is None else error.predictive_score,
        "predictive_text": "…" if error is None else _nats(error.predictive_score),
        "adequate": None if step.check is None else step.check.adequate,
        "checked": step.check is not None,
    }


def _worst(worst: tuple[float, float] | None) -> str:
    return "–" if worst is None else f"×{number(worst[0], 3)} at {number(worst[1], 3)} s"


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{number(value, 2)} %"


def _nats(value: float | None) -> str:
    return "–" if value is None else f"{number(value, 4)} nats"

"""Wandering lines: a narrow band replaces lines that are closer than the record resolves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import CATALOGUE, Model, Stochastic
from allanite.fit import refitted
from allanite.fit.likelihood.peaks import MAX_MISSING_FRACTION
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence
from allanite.study.drop_and_replace import line_distance
from allanite.study.error_comparison import no_error_rises
from allanite.study.ladder import Rung
from allanite.study.spectrum_changes import delta_logl
from allanite.suggestion.constants import MAX_WANDERING_LINE_DISTANCE, MIN_BEAT_EVIDENCE

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.suggestion import Suggestion

__all__ = ["wandering_line_step"]


def wandering_line_step(fit: Fit, suggestion: Suggestion, start_count: int) -> Rung | None:
    """Step on which a narrow band replaces the lines near a suggested line, and the suggested line; else None.

    Two lines that beat are as good as one line whose phase or amplitude wanders, until there is a third. The band is taken
    if it explains as much as the lines. Lines of the initial model, the first `start_count` effects, are never replaced.
    """
    line = suggestion.effect
    if not _is_line(line) or fit.data.lost > MAX_MISSING_FRACTION:
        return None
    near = [
        i
        for i, e in enumerate(fit.model)
        if _is_line(e) and line_distance(e, line) < MAX_WANDERING_LINE_DISTANCE / fit.data.duration
    ]
    if not near or near[0] < start_count:
        return None
    at = [
        sum(e.occupies) / 2.0 for e in (line, *(fit.model.effects[i] for i in near)) if e.occupies
    ]
    half = max(0.5 * (max(at) - min(at)), 1.0 / fit.data.duration)
    middle = 0.5 * (max(at) + min(at))
    band = _band(middle - half, middle + half)
    if band is None:
        return None
    rest = tuple(e for i, e in enumerate(fit.model) if i not in near)
    one = refitted(fit, Model((*rest, band)))
    lines = fit.add(suggestion)
    beat = min(line_distance(fit.model.effects[i], line) for i in near) * fit.data.duration < 1.0
    least = evidence(lines.solution) - (MIN_BEAT_EVIDENCE if beat else MAX_RIVAL_LOG_EVIDENCE)
    if evidence(one.solution) < least or not no_error_rises(fit, one):
        return None
    gone = tuple(fit.model.effects[i].kind for i in near)
    return Rung(one, one.model.effects[-1], gone, delta_logl(fit, one))


def _is_line(effect: Effect) -> bool:
    """True if the effect is a line without harmonics."""
    return effect.screened == "line" and effect.occupies is not None and len(effect.peaks) == 1


def _band(low: float, high: float) -> Stochastic | None:
    """Narrow band of the catalogue between two frequencies; None if there is none."""
    kinds = (cls() for cls in CATALOGUE if issubclass(cls, Stochastic))
    return next((made for blank in kinds if (made := blank.banded(low, high)) is not None), None)

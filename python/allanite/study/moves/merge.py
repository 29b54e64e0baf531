"""Merge: one effect takes the place of several that are its parts.

Lines that the record does not resolve are one wandering line, several excursions are one effect, and a stack of effects of
one kind is one free shape. Other relations have modules of their own: `levels`, and `narrow_bands` for harmonics and side
bands.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from allanite.effects import CATALOG, Deterministic, Model, Stochastic
from allanite.fit import refitted
from allanite.fit.likelihood.peaks import MAX_MISSING_FRACTION
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, discrepancy_gain, evidence
from allanite.fit.rivals.score import is_broad
from allanite.study.judgement import no_error_rises, predicts_as_well, score_change
from allanite.study.relations import line_distance
from allanite.suggestion.constants import MAX_WANDERING_LINE_DISTANCE, MIN_DELTA_LOGL_OVER_SIMPLER
from allanite.suggestion.screens.several_excursions import merged_excursions
from allanite.suggestion.unexplained_shape import unexplained_effect

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung
    from allanite.study.state import State
    from allanite.suggestion import Suggestion


def with_wandering_line(before: State, suggestion: Suggestion) -> State | None:
    """`State` in which one narrow band replaces a suggested line and the lines of the model near it; or None.

    Lines nearer than 3/T count; T is the duration of the record. The score of the band may be at most 3 nats below that
    of separate lines, or 8 nats if a line is nearer than 1/T and they beat. None otherwise, without lines near it, or if
    one is the user's. None as well if an error rises beyond its scatter, or if more than 10 % of the samples are
    missing.
    """
    fit, line = before.fit, suggestion.effect
    if not _is_single_line(line) or fit.data.lost > MAX_MISSING_FRACTION:
        return None
    duration, effects = fit.data.duration, fit.model.effects
    reach = MAX_WANDERING_LINE_DISTANCE / duration
    near = [
        p for p, e in enumerate(effects) if _is_single_line(e) and line_distance(e, line) < reach
    ]
    if not near or any(map(before.is_given, near)):
        return None
    at = [e.occupies[0] for e in (line, *(effects[p] for p in near)) if e.occupies]
    middle, half = 0.5 * (max(at) + min(at)), max(0.5 * (max(at) - min(at)), 1.0 / duration)
    band = _band(middle - half, middle + half)
    if band is None:
        return None
    one = refitted(fit, Model((*(e for p, e in enumerate(effects) if p not in near), band)))
    beat = min(line_distance(effects[p], line) for p in near) * duration < 1.0
    least = -MIN_DELTA_LOGL_OVER_SIMPLER if beat else -MAX_RIVAL_LOG_EVIDENCE
    if score_change(fit.add(suggestion), one) < least or not no_error_rises(fit, one):
        return None
    return before.after(one, near)


def _is_single_line(effect: Effect) -> bool:
    """True if the effect is a line without harmonics."""
    return effect.periodic and effect.occupies is not None and len(effect.peaks) == 1


def _band(low: float, high: float) -> Stochastic | None:
    """Effect of the catalog with a narrow band between two frequencies, Hz; None if no kind has one."""
    kinds = (cls() for cls in CATALOG if issubclass(cls, Stochastic))
    return next((made for blank in kinds if (made := blank.banded(low, high)) is not None), None)


def with_merged_excursions(before: State) -> State | None:
    """`State` with one effect for all excursions (short events) that the search added; None if there are fewer than two."""
    effects = before.fit.model.effects
    places = [p for p in before.added if effects[p].returns]
    known = [e for p in places if isinstance(e := effects[p], Deterministic)]
    one = merged_excursions(known) if len(known) > 1 else None
    if one is None:
        return None
    others = Model(tuple(e for p, e in enumerate(effects) if p not in places))
    return before.after(refitted(before.fit, others + one), places)


def with_nameless_shape(ladder: Sequence[Rung], before: State) -> State | None:
    """`State` in which one free shape of the spectrum replaces two or more added random effects; None if they stay.

    Only these added effects are replaced: broad bands, power laws, and effects whose kind occurs more than once; none of
    a kind of the initial model. Three conditions must hold:

    * The log evidence, without the part due to the model discrepancy, rises by at least 3 nats. Or an effect of the
      initial model is newly detected, and the part due to the discrepancy rises by less than 3 nats.
    * The free shape predicts unseen data as well as the effects that it replaces.
    * No error rises beyond its scatter, compared with the last step without these kinds of effects.
    """
    fit, effects = before.fit, before.fit.model.effects
    count = Counter(effect.kind for effect in effects)
    places = tuple(
        place
        for place in before.added
        if isinstance(e := effects[place], Stochastic)
        and e.kind not in before.given
        and (count[e.kind] > 1 or e.last_resort or is_broad(e))
    )
    if len(places) < 2:
        return None
    others = (e for place, e in enumerate(effects) if place not in places)
    better = refitted(fit, Model((*others, unexplained_effect())))
    left = [discrepancy_gain(one.solution, one.data) for one in (fit, better)]
    more = evidence(better.solution) - evidence(fit.solution) + left[0] - left[1]
    instead = (
        _detects_hidden_kind(fit, better, before.given)
        and left[1] < left[0] + MAX_RIVAL_LOG_EVIDENCE
    )
    if (more < MAX_RIVAL_LOG_EVIDENCE and not instead) or not predicts_as_well(fit, better):
        return None
    # The stack may have described chance deviations, so the errors are compared with those before it.
    kinds = {effects[place].kind for place in places}
    unstacked = [rung.fit for rung in ladder if not kinds & {e.kind for e in rung.fit.model}]
    return before.after(better, places) if no_error_rises(unstacked[-1], better) else None


def _detects_hidden_kind(fit: Fit, better: Fit, kinds: Collection[str]) -> bool:
    """True if an effect of one of the `kinds` is detected in the fit `better` but not in `fit`."""
    shown = [
        {e.kind for place, e in enumerate(one.model) if is_detected(one, place)}
        for one in (fit, better)
    ]
    return not (shown[1] - shown[0]).isdisjoint(kinds)

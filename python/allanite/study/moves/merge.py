"""Merge: one effect takes the place of several that are its parts.

Lines that the record does not resolve are one wandering line, several excursions are one effect, several changes of the
white-noise level are one, and a stack of effects of one kind is one free shape. Harmonics and side bands have a module of
their own, `narrow_bands`.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOG, Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit import refitted
from allanite.fit.likelihood.peaks import MAX_MISSING_FRACTION
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, discrepancy_gain, evidence
from allanite.fit.rivals.score import is_broad
from allanite.study.judgement import no_error_rises, predicts_as_well, score_change
from allanite.study.moves.add import trial_fit
from allanite.study.relations import line_distance
from allanite.suggestion.constants import (
    MAX_SEPARATE_LEVEL_INTERVALS,
    MAX_WANDERING_LINE_DISTANCE,
    MIN_DELTA_LOGL_OVER_SIMPLER,
)
from allanite.suggestion.screens.level_changes import level_series, screen_levels
from allanite.suggestion.screens.several_excursions import merged_excursions
from allanite.suggestion.unexplained_shape import unexplained_effect

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung
    from allanite.study.state import State
    from allanite.suggestion import Suggestion
    from allanite.suggestion.screens import Candidate


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
    if score_change(trial_fit(fit, suggestion), one) < least or not no_error_rises(fit, one):
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


def with_merged_levels(before: State) -> State | None:
    """`State` in which one effect replaces all changes of the white-noise level that the search added; or None.

    The effect is the one with the largest ΔlogL minus BIC cost, for the white-noise power over time: one that a new search
    finds, or all added changes together. None if the power over time is not known. None as well if no effect has a ΔlogL
    more than 3 nats above that of the added changes without the last one.
    """
    fit = before.fit
    changes, places = _added_level_changes(before)
    base = refitted(fit, Model(tuple(e for e in fit.model if e not in changes)))
    whitened = whiten(base.solution, base.data)
    series = level_series(base.solution, base.data, whitened)
    if series is None:
        return None
    power = np.maximum(series.judged, 1e-12)
    price = 0.5 * np.log(max(series.freedom * power.size, 2.0))

    def explained(level: Modifier) -> float:
        """ΔlogL, nats, of a change of level compared with a constant level, from the white-noise power over time.

        Times with the same factor share one level: their mean power.
        """
        _, which = np.unique(level.gain(series.times), return_inverse=True)
        count = np.bincount(which)
        means = np.bincount(which, weights=power) / count
        return float(-0.5 * series.freedom * (count @ np.log(means / power.mean())))

    def worth(level: Modifier) -> float:
        """ΔlogL of a change of level less the BIC cost of its parameters, nats."""
        return explained(level) - price * level.numbers

    had = max((explained(level) for level in _product_levels(changes[:-1])), default=0.0)
    found = [
        *_switching_levels(screen_levels(base.solution, base.data, whitened)),
        *_product_levels(changes),
    ]
    # Requiring more each time prevents a loop between equal sets.
    found = [level for level in found if explained(level) > had + MAX_RIVAL_LOG_EVIDENCE]
    if not found:
        return None
    return before.after(refitted(base, base.model + max(found, key=worth)), places)


def must_merge_levels(state: State) -> bool:
    """True if the changes of the noise level that the search added must become one effect.

    At most two changes may stay separate, and two only if each is an interval after which the level returns to its first
    value.
    """
    changes, _ = _added_level_changes(state)
    intervals = all(len(e.switches[0]) == 2 and e.switches[1][-1] == 1.0 for e in changes)
    return len(changes) > (MAX_SEPARATE_LEVEL_INTERVALS if intervals else 1)


def _added_level_changes(state: State) -> tuple[list[Modifier], list[int]]:
    """Pair of lists: added effects that change the level of all white noise at given times, and their indices in the model.

    Periodic levels, levels that follow a column, and levels of one band are left out: they have no `switches`.
    """
    effects = state.fit.model.effects
    found = [(e, p) for p in state.added if isinstance(e := effects[p], Modifier) and e.switches[0]]
    return [e for e, _ in found], [p for _, p in found]


def _switching_levels(candidates: Iterable[Candidate]) -> list[Modifier]:
    """List of the effects of the `candidates` that change the level of the white noise at given times (`switches`)."""
    return [c.effect for c in candidates if isinstance(c.effect, Modifier) and c.effect.switches[0]]


def _product_levels(changes: list[Modifier]) -> list[Modifier]:
    """List of effects, one for each suitable kind of the catalog, whose level is the product of the levels of `changes`."""
    times = np.array(sorted({t for change in changes for t in change.switches[0]}))
    gains = np.prod([change.gain(times) for change in changes], axis=0)
    kept = np.flatnonzero(np.diff([1.0, *gains]))
    many = {"times": tuple(times[kept].tolist()), "factors": tuple(gains[kept].tolist())}
    kinds = [cls for cls in CATALOG if issubclass(cls, Modifier)]
    return [effect for cls in kinds if (effect := cls.from_values(**many)) is not None]

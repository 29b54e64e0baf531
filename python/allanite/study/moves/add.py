"""Add an effect that a check found missing, instead of the effects in its place, with a second effect if needed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Effect, Model
from allanite.fit import refitted
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.study.judgement import (
    allan_error_rises,
    discrepancy_rises,
    no_error_rises,
    predicts_as_well,
    score_change,
)
from allanite.study.relations import is_same_feature, lies_mostly_within
from allanite.study.state import State, places_lost
from allanite.suggestion.check import last_check
from allanite.suggestion.constants import MAX_FORMS_TRIED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.result import Fit
    from allanite.suggestion import Check, Suggestion


def trial_fit(fit: Fit, addition: Effect | Suggestion) -> Fit:
    """`Fit` like `fit.add(addition)`, but to the missing samples as they are completed now.

    Completing many missing samples again takes longer than all else in a trial, so only an accepted step does it.
    """
    if isinstance(addition, Effect):
        return refitted(fit, fit.model + addition)
    return refitted(
        fit, addition.found.model if addition.before is fit else fit.model + addition.effect
    )


def with_addition(before: State, addition: Effect | Suggestion) -> State | None:
    """`State` of the model with one more effect, or with this effect in place of another; or None.

    The first case that applies counts:

    * A suggestion that replaces effects (`replaced_kinds`) replaces them, whatever the score is. None if one of them is the
      user's.
    * If the new effect excludes a segment, effects that the search added and that lie mostly inside are removed.
    * If the model has an effect at the same feature of the spectrum, the new effect replaces it, for example a line a band.
      The score must rise by more than 3 nats, and the old effect must not be the user's; otherwise None.
    * Otherwise, the effect is added, whatever the score is.
    """
    fit = before.fit
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(addition, Effect) and addition.replaced_kinds:
        lost = places_lost(fit.model, addition.found.model)
        return (
            None
            if any(map(before.is_given, lost))
            else before.after(trial_fit(fit, addition), lost)
        )
    effects = fit.model.effects
    if effect.removes and effect.when is not None:
        lost = tuple(p for p in before.added if lies_mostly_within(effects[p], effect.when, fit))
        if not lost:
            return before.after(trial_fit(fit, addition))
        others = tuple(e for p, e in enumerate(effects) if p not in lost)
        return before.after(refitted(fit, Model((*others, effect))), lost)
    place = next((i for i, e in enumerate(effects) if is_same_feature(e, effect, fit)), None)
    if place is None:
        return before.after(trial_fit(fit, addition))
    if before.is_given(place):
        return None
    better = refitted(fit, Model((*effects[:place], *effects[place + 1 :], effect)))
    clearly = score_change(fit, better) > MAX_RIVAL_LOG_EVIDENCE
    return before.after(better, (place,)) if clearly else None


def with_second_effect(
    before: State, after: State, check: Check, tolerable: bool
) -> tuple[State, Suggestion] | None:
    """Pair: `State` with a second effect added to `after`, and the suggestion of this effect; None if no effect helps.

    `after` is `before` plus a first effect. The second effect must leave no error above that of `before` beyond its
    scatter. The significant suggestions of `check`, made for `before`, are tried first. If the first effect alone is
    `tolerable`, the score must rise by more than 3 nats, and the discrepancy must not exceed that of `before`. Otherwise,
    if the Allan error still rises and the first effect replaced no other, the suggestions of a check of `after`, which may
    replace the first effect, are tried too. Of the two results, the one with the lower Allan error is returned. An
    exclusion gets no second exclusion.
    """
    new = after.fit.model.effects[-1]

    def allowed(suggestions: Sequence[Suggestion]) -> list[Suggestion]:
        """List of the `suggestions` without second exclusions: the next check sees what the first one leaves."""
        return [s for s in suggestions if not (new.removes and s.effect.removes)]

    others = [s for s in check.significant if s.kind != new.kind]
    first = _first_tolerable_pair(before, after, allowed(others))
    if tolerable:
        if first is None or discrepancy_rises(before.fit, first[0].fit):
            return None
        return first if score_change(after.fit, first[0].fit) > MAX_RIVAL_LOG_EVIDENCE else None
    found = first is not None and not allan_error_rises(before.fit, first[0].fit)
    if found or (after.lost_since(before) and not new.removes):
        return first
    second = _first_tolerable_pair(before, after, allowed(last_check(after.fit).significant))
    if first is None or (second and allan_error_rises(second[0].fit, first[0].fit)):
        return second
    return first


def _first_tolerable_pair(
    before: State, after: State, suggestions: Sequence[Suggestion]
) -> tuple[State, Suggestion] | None:
    """Pair: `State` with one of the first 8 `suggestions` added, and that suggestion; or None.

    It is the first suggestion with which the Allan error does not rise, otherwise the first with which no error rises
    beyond its scatter. Errors are compared with `before`; `after` lacks the suggestion.
    """
    tolerable: tuple[State, Suggestion] | None = None
    for suggestion in suggestions[:MAX_FORMS_TRIED]:
        if suggestion.replaced_kinds:
            lost = places_lost(after.fit.model, suggestion.found.model)
            if lost != after.new_since(before):
                continue
        elif is_already_explained(suggestion, after.fit):
            continue
        else:
            lost = ()
        both = after.after(trial_fit(after.fit, suggestion), lost)
        # The prediction takes most of the time and comes last.
        if no_error_rises(before.fit, both.fit) and (
            suggestion.effect_happens_once or predicts_as_well(after.fit, both.fit)
        ):
            if not allan_error_rises(before.fit, both.fit):
                return both, suggestion
            tolerable = tolerable or (both, suggestion)
    return tolerable


def is_already_explained(suggestion: Suggestion, fit: Fit) -> bool:
    """True if the model has an effect at the same feature of the spectrum, or excludes most of the suggested effect.

    True as well if the suggestion would replace another effect, or if its kind may occur only once and the model has it.
    """
    effect = suggestion.effect
    if suggestion.replaced_kinds or (
        effect.single and any(e.kind == effect.kind for e in fit.model)
    ):
        return True
    out = [e.when for e in fit.model.modifiers if e.removes and e.when is not None]
    if any(lies_mostly_within(effect, when, fit) for when in out):
        return True
    return any(is_same_feature(e, effect, fit) for e in fit.model)

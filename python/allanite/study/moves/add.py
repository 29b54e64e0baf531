"""Add an effect that a check found missing, instead of the effects in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Effect, Model
from allanite.fit import refitted
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.study.judgement import score_change
from allanite.study.relations import is_same_feature, lies_mostly_within
from allanite.study.state import places_lost

if TYPE_CHECKING:
    from allanite.fit.result import Fit
    from allanite.study.state import State
    from allanite.suggestion import Suggestion


def with_addition(before: State, addition: Effect | Suggestion) -> State | None:
    """`State` of the model with one more effect, or with this effect in place of another; or None.

    * If the model has an effect at the same feature of the spectrum, the new effect replaces it, for example a line a
      band. The score must rise by more than 3 nats, and the old effect must not be the user's; otherwise None.
    * A suggestion that replaces effects does so without a test; None if one of them is the user's.
    * If the new effect excludes a segment, effects that the search added and that lie mostly inside are removed.
    * Otherwise, the effect is added without a test.
    """
    fit = before.fit
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(addition, Effect) and addition.gives_way:
        lost = places_lost(fit.model, addition.found.model)
        return None if any(map(before.is_given, lost)) else before.after(fit.add(addition), lost)
    effects = fit.model.effects
    if effect.removes and effect.when is not None:
        lost = tuple(p for p in before.added if lies_mostly_within(effects[p], effect.when, fit))
        if not lost:
            return before.after(fit.add(addition))
        others = tuple(e for p, e in enumerate(effects) if p not in lost)
        return before.after(refitted(fit, Model((*others, effect))), lost)
    place = next((i for i, e in enumerate(effects) if is_same_feature(e, effect, fit)), None)
    if place is None:
        return before.after(fit.add(addition))
    if before.is_given(place):
        return None
    better = refitted(fit, Model((*effects[:place], *effects[place + 1 :], effect)))
    clearly = score_change(fit, better) > MAX_RIVAL_LOG_EVIDENCE
    return before.after(better, (place,)) if clearly else None


def is_already_explained(suggestion: Suggestion, fit: Fit) -> bool:
    """True if the model needs no further effect for this suggestion.

    This holds if the model has an effect at the same feature of the spectrum, or excludes a segment in which the
    suggested effect mostly lies. It also holds if the suggestion would replace another effect, or if its kind may occur
    only once and the model has it.
    """
    effect = suggestion.effect
    if suggestion.gives_way or (effect.single and any(e.kind == effect.kind for e in fit.model)):
        return True
    out = [e.when for e in fit.model.modifiers if e.removes and e.when is not None]
    if any(lies_mostly_within(effect, when, fit) for when in out):
        return True
    return any(is_same_feature(e, effect, fit) for e in fit.model)

"""What an addition shows to be missing beside it, or in its place, where alone it lets an error rise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.study.drop_and_replace import mostly_within, one_thing
from allanite.study.error_comparison import errors_fall, predicts, rises, wider
from allanite.suggestion import check_fit
from allanite.suggestion.constants import MAX_SECOND_EFFECTS_TRIED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.result import Fit
    from allanite.suggestion import Check, Suggestion

__all__ = ["is_there", "with_another"]


def with_another(
    before: Fit, better: Fit, check: Check, falls: bool
) -> tuple[Fit, Suggestion] | None:
    """The fit with one effect more, where an addition shows that two are missing: alone it lets an error rise.

    Of those that `check` found missing before, else of those that are missing beside the addition, or in its place. Where
    the errors fall but for a discrepancy that is larger within its interval, one is taken that is clearly better and makes
    it smaller.
    """
    if falls:
        # What takes the place of the addition has a rung of its own.
        beside = [s for s in check_fit(better).significant if not s.gives_way]
        pair = _best_beside(before, better, beside)
        if pair is None or wider(before, pair[0]):
            return None
        return (
            pair
            if evidence_gain(pair[0].solution, better.solution, better.data)
            > MAX_RIVAL_LOG_EVIDENCE
            else None
        )
    new = better.model.effects[-1].kind
    known = [s for s in check.significant if s.kind != new]
    first = _best_beside(before, better, known)
    if first is not None and not rises(before, first[0]):
        return first
    second = _best_beside(before, better, check_fit(better).significant)
    return second if first is None or (second and rises(second[0], first[0])) else first


def _best_beside(
    before: Fit, better: Fit, suggestions: Sequence[Suggestion]
) -> tuple[Fit, Suggestion] | None:
    """The fit with the first of the suggestions beside which the Allan error falls, else no error rises; and which."""
    tolerable: tuple[Fit, Suggestion] | None = None
    for suggestion in suggestions[:MAX_SECOND_EFFECTS_TRIED]:
        if not _stands_in(suggestion, before, better) and is_there(suggestion, better):
            continue
        both = better.add(suggestion)
        if not suggestion.effect_happens_once and not predicts(better, both):
            continue
        if errors_fall(before, both):
            if not rises(before, both):
                return both, suggestion
            tolerable = tolerable or (both, suggestion)
    return tolerable


def _stands_in(suggestion: Suggestion, before: Fit, better: Fit) -> bool:
    """Whether an addition gives way to a suggestion, and nothing else does."""
    kind = better.model.effects[-1].kind
    return suggestion.gives_way == (kind,) and all(e.kind != kind for e in before.model)


def is_there(suggestion: Suggestion, fit: Fit) -> bool:
    """Whether a model has the effect already, or one that is the same hump of the spectrum, or that gives way to it.

    Or takes out the samples in which it is.
    """
    effect = suggestion.effect
    if suggestion.gives_way or (effect.single and any(e.kind == effect.kind for e in fit.model)):
        return True
    out = [e.when for e in fit.model.modifiers if e.removes and e.when is not None]
    if any(mostly_within(effect, when, fit) for when in out):
        return True
    return any(one_thing(e, effect, fit) for e in fit.model)

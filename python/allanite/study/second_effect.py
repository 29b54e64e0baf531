"""Second effect: added with, or instead of, an addition that alone would raise an error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.study.drop_and_replace import is_same_feature, lies_mostly_within
from allanite.study.error_comparison import (
    allan_error_rises,
    discrepancy_rises,
    no_error_rises,
    predicts_as_well,
)
from allanite.suggestion import check_fit
from allanite.suggestion.constants import MAX_SECOND_EFFECTS_TRIED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.result import Fit
    from allanite.suggestion import Check, Suggestion

__all__ = ["is_already_explained", "with_second_effect"]


def with_second_effect(
    before: Fit, better: Fit, check: Check, falls: bool
) -> tuple[Fit, Suggestion] | None:
    """Fit with a second effect beside an addition that alone raises an error, and the suggestion added; None if none helps.

    Candidates are the effects that `check` found missing before, else those missing beside the addition, or in its place.
    If only the discrepancy rises, within its interval (`falls`), the second effect must have a clearly higher score and
    lower the discrepancy.
    """
    if falls:
        # A suggestion that replaces the addition gets a step of its own.
        beside = [s for s in check_fit(better).significant if not s.gives_way]
        pair = _best_beside(before, better, beside)
        if pair is None or discrepancy_rises(before, pair[0]):
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
    if first is not None and not allan_error_rises(before, first[0]):
        return first
    second = _best_beside(before, better, check_fit(better).significant)
    return second if first is None or (second and allan_error_rises(second[0], first[0])) else first


def _best_beside(
    before: Fit, better: Fit, suggestions: Sequence[Suggestion]
) -> tuple[Fit, Suggestion] | None:
    """Fit with the first suggestion beside which no error rises beyond its scatter, and that suggestion; or None.

    A suggestion beside which the Allan error does not rise at all goes before the others.
    """
    tolerable: tuple[Fit, Suggestion] | None = None
    for suggestion in suggestions[:MAX_SECOND_EFFECTS_TRIED]:
        if not _replaces_addition(suggestion, before, better) and is_already_explained(
            suggestion, better
        ):
            continue
        both = better.add(suggestion)
        if not suggestion.effect_happens_once and not predicts_as_well(better, both):
            continue
        if no_error_rises(before, both):
            if not allan_error_rises(before, both):
                return both, suggestion
            tolerable = tolerable or (both, suggestion)
    return tolerable


def _replaces_addition(suggestion: Suggestion, before: Fit, better: Fit) -> bool:
    """True if the suggestion replaces only the addition, whose kind the model before lacks."""
    kind = better.model.effects[-1].kind
    return suggestion.gives_way == (kind,) and all(e.kind != kind for e in before.model)


def is_already_explained(suggestion: Suggestion, fit: Fit) -> bool:
    """True if a model has the effect, one at the same feature of the spectrum, or one that excludes its samples.

    True as well if another effect would have to give way.
    """
    effect = suggestion.effect
    if suggestion.gives_way or (effect.single and any(e.kind == effect.kind for e in fit.model)):
        return True
    out = [e.when for e in fit.model.modifiers if e.removes and e.when is not None]
    if any(lies_mostly_within(effect, when, fit) for when in out):
        return True
    return any(is_same_feature(e, effect, fit) for e in fit.model)

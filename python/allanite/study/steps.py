"""One step of the search: candidates by score, moves, judgement.

The first of `_candidates` that helps is added, with what it needs and without what it makes needless. If none helps,
the first drop, replacement, split or merge that helps follows, in order of expected gain (`best_replacement`). The last
resort is a suggestion that is not significant but makes a rejected fit adequate.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.errors import TooShortError
from allanite.effects import Model
from allanite.fit import completed_again, refitted
from allanite.fit.likelihood.changing_power import changing_effects
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.study.judgement import (
    allan_error_rises,
    changed_bins,
    delta_logl,
    discrepancy_rises,
    is_doubtful_event,
    leaves_others_unchanged,
    no_error_rises,
    predicts_as_well,
    score_change,
)
from allanite.study.ladder import Rung, kinds_added_again, rung_of
from allanite.study.moves.add import is_already_explained, with_addition, with_second_effect
from allanite.study.moves.drop import models_with_one_dropped, without_needless
from allanite.study.moves.merge import (
    must_merge_levels,
    with_merged_excursions,
    with_merged_levels,
    with_nameless_shape,
    with_wandering_line,
)
from allanite.study.moves.narrow_bands import with_harmonics_or_side_bands
from allanite.study.moves.replace import models_with_replacement, with_lines_of_band
from allanite.study.state import State, state_of
from allanite.suggestion import Check, Suggestion, explain_same_misfit
from allanite.suggestion.constants import (
    MAX_EVENT_LOG10_P,
    MAX_EXPLAINED_REMAINDER,
    MIN_SCORE_GAIN,
)
from allanite.suggestion.exclusions_first import excludes_or_changes_level
from allanite.suggestion.screens.slow_functions import has_known_time

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.fit.result import Fit

    #: A step, and the suggestions that it adds.
    Found = tuple[Rung, tuple[Suggestion, ...]]


def next_step(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """Next step (`Rung`) of `improve` after a check of the last fit; None if nothing helps."""
    found = step_and_suggestions(ladder, check)
    return None if found is None else found[0]


def step_and_suggestions(ladder: Sequence[Rung], check: Check) -> Found | None:
    """Pair (`Rung`, suggestions): the next step after a check of the last fit, and what it adds; None if nothing helps.

    For a replacement of an effect, the tuple of suggestions is empty.
    """
    before = state_of(ladder)
    for suggestion in _candidates(check):
        found = _step_with(ladder, before, suggestion, check)
        if found is not None:
            return found
    rung = best_replacement(ladder)
    if rung is not None:
        return rung, ()
    return _step_for_rejected_fit(ladder, before, check)


def _candidates(check: Check) -> list[Suggestion]:
    """List of the suggestions to try in the next step, best first; empty if no suggestion is significant.

    The significant suggestions come last. Before them come other suggestions that explain the same misfit as the first
    significant one, if their score is more than 3 nats higher. Events are not among these, because their score does not
    count the many times that were tried.
    """
    significant = list(check.significant)
    if not significant:
        return []
    first = significant[0]
    least = max(first.score, 0.0) + MAX_RIVAL_LOG_EVIDENCE
    better = [
        s
        for s in check.suggestions
        if s.score > least and not (s.significant or s.effect_happens_once)
    ]
    return [s for s in better if explain_same_misfit(s, first)] + significant


def _step_for_rejected_fit(ladder: Sequence[Rung], before: State, check: Check) -> Found | None:
    """Pair (`Rung`, suggestions): step that makes an inadequate fit adequate with a suggestion that is not significant.

    The suggestion must have a score above 3 nats. None if the fit is already adequate, or if no suggestion makes it so.
    """
    # The whole curve has shown that an effect is missing, so clear evidence which one suffices.
    if check.fit.adequate:
        return None
    for suggestion in check.suggestions:
        if suggestion.significant or suggestion.score <= MAX_RIVAL_LOG_EVIDENCE:
            continue
        found = _step_with(ladder, before, suggestion, check)
        if found is not None and found[0].fit.adequate:
            return found
    return None


def best_replacement(ladder: Sequence[Rung]) -> Rung | None:
    """Step (`Rung`) that drops, replaces, splits or merges effects of the last model; None if no such step helps.

    A merge of several effects into one free shape comes first (`with_nameless_shape`). Other changes are tried in order
    of their expected gain, down to 0.5 nats. The first change is taken that meets these conditions:

    * The score rises by more than 0.5 nats.
    * No error rises beyond its scatter, and the times of all new events are known.
    * No model of the search with the same excluded samples and level changes has a log evidence over 3 nats higher.

    New effects that are not detected are removed before this comparison, and effects that the change makes needless after
    it.
    """
    before = state_of(ladder)
    shape = with_nameless_shape(ladder, before)
    if shape is not None:
        return rung_of(before, without_needless(before, shape, kinds_added_again(ladder)) or shape)
    fit = before.fit

    def lead(other: Fit) -> float:
        """Ln evidence of another fit minus that of the last fit of the search, nats."""
        return evidence_gain(other.solution, fit.solution, fit.data)

    # The result must not trail another model of the search by more than 3 nats.
    same = changing_effects(fit.model)
    alike = [r for r in ladder if r.fit.data is fit.data and changing_effects(r.fit.model) == same]
    least = max(lead(rung.fit) for rung in alike)
    least -= MAX_RIVAL_LOG_EVIDENCE
    less = models_with_one_dropped(before, kinds_added_again(ladder))
    changes = (*less, *models_with_replacement(fit))
    for promised, places, model, prior in sorted(changes, key=lambda change: -change[0]):
        if promised <= MIN_SCORE_GAIN:
            break
        after = _without_undetected(before, before.after(refitted(fit, model), places))
        if after is None or lead(after.fit) < max(least, MIN_SCORE_GAIN - prior):
            continue
        # The Allan error takes most of the time and comes last.
        if _new_times_are_known(before, after) and no_error_rises(fit, after.fit):
            needed = kinds_added_again(ladder)
            return rung_of(before, without_needless(before, after, needed) or after)
    return None


def _without_undetected(before: State, after: State) -> State | None:
    """`State` after a step, without its new effects that are not detected; None if none of them is detected."""
    new = after.new_since(before)
    absent = [place for place in new if not is_detected(after.fit, place)]
    if not absent:
        return after
    if len(absent) == len(new):
        return None
    others = Model(tuple(e for place, e in enumerate(after.fit.model) if place not in absent))
    return after.after(refitted(after.fit, others), absent)


def further_steps(
    ladder: Sequence[Rung], check: Check, added: Sequence[Suggestion]
) -> Iterator[Rung]:
    """Iterator over further steps (`Rung`), each of which adds one more suggestion of the same check.

    `added` are the suggestions that the last step added. A suggestion is skipped

    * if it comes before the first of `added` in the order of trial: it was refused already,
    * if it explains the same misfit as an added suggestion, or as one with a higher score,
    * if the model fitted last already explains it,
    * if adding it removes an effect of the initial model,
    * if less than 90 % of its ΔlogL remains (not for exclusions and changes of level),
    * if the spectrum has changed since the check, and it is an exclusion, a change of level, or an event with p > 1e-4.

    The iterator ends after a step that excludes a segment.
    """
    ladder, added, candidates = list(ladder), list(added), _candidates(check)
    unchanged = leaves_others_unchanged(check.fit, ladder[-1])
    first = min((at for at, s in enumerate(candidates) if s in added), default=0)
    for suggestion in candidates[first:]:
        before = ladder[-1]
        if any(e.removes and e.when for e in before.new):
            return
        elsewhere = excludes_or_changes_level(suggestion.effect)
        # The p-value of an event depends on the noise, which an addition may change.
        doubtful = suggestion.effect_happens_once and suggestion.log10_p > MAX_EVENT_LOG10_P
        if (
            suggestion in added
            or any(
                explain_same_misfit(s, suggestion)
                for s in check.suggestions
                if s in added or s.score > suggestion.score
            )
            or is_already_explained(suggestion, before.fit)
            or ((elsewhere or doubtful) and not unchanged)
        ):
            continue
        found = _step_with(ladder, state_of(ladder), suggestion, check, alone=True)
        if found is None or found[0].dropped_start:
            continue
        rung, _ = found
        seen = suggestion.delta_log_likelihood - suggestion.surplus
        left = delta_logl(before.fit, rung.fit)
        if not elsewhere and left < (1.0 - MAX_EXPLAINED_REMAINDER) * seen:
            continue
        if rung.fit.data is not before.fit.data:
            before.fit.data.clear_caches()
        unchanged = unchanged and leaves_others_unchanged(before.fit, rung)
        ladder.append(rung)
        yield rung
        added.append(suggestion)


def _new_times_are_known(before: State, after: State) -> bool:
    """True if the times of all steps and events that `after` has and `before` lacks are known (`has_known_time`)."""
    solution, data = after.fit.solution, after.fit.data
    new = [solution.effects[place] for place in after.new_since(before)]
    return all(has_known_time(own, solution, data) for own in new)


def _step_with(
    ladder: Sequence[Rung], before: State, suggestion: Suggestion, check: Check, alone: bool = False
) -> Found | None:
    """Pair (`Rung`, suggestions): step that adds `suggestion`, and all suggestions that it adds; None if it is refused.

    It is refused in these cases:

    * An exclusion leaves too few samples.
    * It takes the place of an effect of the user's model, or of another effect with a rise of the score of at most 3 nats
      (`with_addition`).
    * The model predicts unseen data worse, or an error rises beyond its scatter and no second effect prevents this
      (`_merged_or_added`).
    * `alone` is True, and a second effect is needed.
    * Changes of level must be merged into one effect, but cannot.
    * The kinds of effects and times of level changes stay the same, and the score rises by less than 3 nats.
    * The time of a new event is not known (`has_known_time`), or the suggestion is a doubtful event (`is_doubtful_event`).
    """
    try:
        found = _merged_or_added(before, suggestion, check, alone)
    except TooShortError:
        return None  # the exclusion would leave too few samples
    if found is None:
        return None
    added, risen, suggestions = found
    after = _merged_and_dropped(ladder, before, added)
    if after is None or _is_unchanged(before.fit, after.fit):
        return None
    # The likelihoods of other samples, of levels and of moving bands are not comparable: the check compared them.
    risen += delta_logl(added.fit, after.fit)
    known = _new_times_are_known(before, after)
    if not known or is_doubtful_event(before.fit, after.fit, suggestion):
        return None
    after = replace(after, fit=completed_again(after.fit, before.fit))
    first = suggestions[0]
    return rung_of(before, after, first.kind, risen, first.trials), suggestions


def _merged_or_added(
    before: State, suggestion: Suggestion, check: Check, alone: bool
) -> tuple[State, float, tuple[Suggestion, ...]] | None:
    """Tuple (`State`, ΔlogL, suggestions) after `suggestion` is added, with a second effect if needed; or None.

    The suggestions are those added, the one to name first. A line near other lines is merged with them into a wandering
    band if possible. Lines replace a new effect that they explain better (`with_lines_of_band`). Changes of level are added
    whatever the errors are. None if the new model predicts worse (not tested for effects that happen once), or if an error
    rises by more than its scatter and no second effect prevents it. With `alone`, no second effect is searched; then also
    None if the discrepancy rises at all, or if the effect excludes samples and the Allan error rises.
    """
    fit, effect = before.fit, suggestion.effect
    wandering = with_wandering_line(before, suggestion)
    if wandering is not None:
        return wandering, delta_logl(fit, wandering.fit), (suggestion,)
    after = with_addition(before, suggestion)
    if after is None:
        return None
    split = with_lines_of_band(before, after, suggestion, check)
    if split is not None:
        return split[0], delta_logl(fit, split[0].fit), split[1]
    if not suggestion.effect_happens_once and not predicts_as_well(fit, after.fit):
        return None
    risen = suggestion.delta_log_likelihood - suggestion.surplus
    if after.lost_since(before) and not suggestion.replaced_kinds:
        risen = delta_logl(fit, after.fit) or risen
    if effect.changes_level:
        return after, risen, (suggestion,)  # the Allan curve does not show when a sensor is loud
    tolerable = no_error_rises(fit, after.fit)
    # An effect that the excluded samples had hidden is added in the same step.
    hidden = effect.removes and allan_error_rises(fit, after.fit)
    if tolerable and not hidden and not discrepancy_rises(fit, after.fit):
        return after, risen, (suggestion,)
    if alone:
        return None
    pair = with_second_effect(before, after, check, tolerable)
    if pair is None:
        return (after, risen, (suggestion,)) if tolerable else None
    both, second = pair
    risen += (
        second.delta_log_likelihood if second.replaced_kinds else delta_logl(after.fit, both.fit)
    )
    # Excluded samples say nothing about the sensor, so an effect is named before them.
    second_first = effect.removes or bool(both.lost_since(after))
    return both, risen, (second, suggestion) if second_first else (suggestion, second)


def _merged_and_dropped(ladder: Sequence[Rung], before: State, added: State) -> State | None:
    """`State` after the merges and drops that an addition makes possible; `added` has the addition.

    None if changes of level must be merged but cannot.
    """
    after = added
    new = [added.fit.model.effects[place] for place in added.new_since(before)]
    if any(effect.returns for effect in new):
        after = with_merged_excursions(after) or after
    if any(effect.changes_level for effect in new):
        if must_merge_levels(after):
            return with_merged_levels(after)
    elif len(ladder) == 1 or changed_bins(before.fit, after.fit).any():
        after = without_needless(before, after, kinds_added_again(ladder)) or after
    return with_harmonics_or_side_bands(before, after)


def _is_unchanged(before: Fit, after: Fit) -> bool:
    """True if kinds of effects and times of level changes are the same, and the score rises by less than 3 nats."""
    old, new = (sorted(e.kind for e in fit.model) for fit in (before, after))
    old_times, new_times = ({e.switches for e in fit.model.modifiers} for fit in (before, after))
    same = old == new and old_times == new_times
    return same and score_change(before, after) < MAX_RIVAL_LOG_EVIDENCE

"""Replace: another effect takes the place of one or two, or two take the place of one (a split)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Effect, Model, Modifier
from allanite.fit import refitted
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.replacements import replacements
from allanite.fit.rivals.score import is_broad
from allanite.study.judgement import no_error_rises, score_change
from allanite.suggestion import Check, Suggestion, explain_same_misfit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.result import Fit
    from allanite.study.state import State


def models_with_replacement(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model, float]]:
    """Iterator over (expected gain, indices, model, prior): models in which others replace one or two detected effects.

    The gain is the expected rise of the score, nats: that of the log evidence plus `prior`, that of the priors. `indices`
    are the places of the replaced effects in the old model. Two effects are replaced together only if both are slow
    processes. The new effects are the last of the new model. Effects of the initial model are replaced like all others.
    """
    for other in replacements(fit, may_take_the_place):
        yield other.lead + other.prior, other.places, other.solution.model, other.prior


def may_take_the_place(effect: Effect, out: Effect) -> bool:
    """True if `effect` may replace `out` because of a higher score alone.

    False in three cases: `effect` is an event and `out` is not; `effect` is a filter, and `out` is neither a filter nor a
    broad hump; `effect` has no physical name.
    """
    # The evidence of an event is not corrected for the many times that were tried.
    event = effect.happens_once and not out.happens_once
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (event or filtering or effect.nameless)


def with_lines_of_band(
    before: State, after: State, band: Suggestion, check: Check
) -> tuple[State, tuple[Suggestion, ...]] | None:
    """Pair: `State` in which lines replace the effect `band` that `after` adds to `before`, and their suggestions; or None.

    The lines are the significant ones of `check` that explain the same misfit, at least two. The score must rise by more
    than 3 nats, and no error beyond its scatter.
    """
    fit = before.fit
    lines = tuple(
        s
        for s in check.significant
        if s.effect.periodic and not s.replaced_kinds and explain_same_misfit(band, s)
    )
    if len(lines) < 2 or band.effect.periodic or after.lost_since(before):
        return None
    split = refitted(fit, Model((*fit.model, *(s.effect for s in lines))))
    clearly = score_change(after.fit, split) > MAX_RIVAL_LOG_EVIDENCE
    return (before.after(split), lines) if clearly and no_error_rises(fit, split) else None

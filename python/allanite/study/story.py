"""Steps that users read: the last model built up from the first, without the detours of the search."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Effect, Model
from allanite.fit import refitted
from allanite.fit.engine import solve
from allanite.fit.rivals.evidence import evidence
from allanite.study.judgement import (
    allan_error_rises,
    allan_error_within_scatter,
    delta_logl,
    no_error_rises,
)
from allanite.study.ladder import Rung
from allanite.study.state import state_of
from allanite.suggestion.exclusions_first import excludes_or_changes_level

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.fit.result import Fit


def story(ladder: Sequence[Rung]) -> tuple[Rung, ...]:
    """Tuple of the steps (`Rung`) that users see: from the first model to the last, with effects added in a readable order.

    A direct search, without dropped effects and without rising errors, is returned unchanged. Otherwise the steps are
    made anew. Exclusions come first. Then each step adds the best effect (`_by_gain`) that does not raise the Allan
    error. If all raise it, each step adds the best effect that lets no error rise beyond its scatter. Without such an
    effect, all remaining effects are added at once. Initial effects that the last model lacks are dropped as soon as the
    evidence is not lower without them.
    """
    if _is_direct(ladder):
        return tuple(ladder)
    last = ladder[-1].fit
    kept, new, leaving = _kept_new_and_leaving(ladder)
    found, gains = [ladder[0]], dict[Effect, tuple[bool, float]]()
    while new:
        before = found[-1].fit
        masks = [e for e in new if e.removes]
        tolerable: list[tuple[Effect, Fit, list[Effect]]] = []
        for effect in masks[:1] or _by_gain(before, [*kept, *leaving], new, gains):
            fit, dropped = last, leaving
            if masks and len(new) > 1:
                # A process of the first model may stand for an event that is added after the exclusions.
                fit, dropped = refitted(before, Model((*kept, effect, *leaving))), []
            elif len(new) > 1:
                fit, dropped = _fit_of_step(before, [*kept, effect], leaving)
            if masks or len(new) == 1 or no_error_rises(before, fit):
                tolerable.append((effect, fit, dropped))
                if not allan_error_rises(before, fit):
                    break
        if not tolerable:
            found.append(_step_with_record(ladder, last, new, leaving))
            break
        effect, fit, dropped = (
            tolerable[0] if allan_error_rises(before, tolerable[-1][1]) else tolerable[-1]
        )
        found.append(_step_with_record(ladder, fit, [effect], dropped))
        kept, new = [*kept, effect], [e for e in new if e is not effect]
        leaving = [e for e in leaving if e not in dropped]
    return tuple(found)


def without_rises(steps: Sequence[Rung]) -> tuple[Rung, ...]:
    """Tuple of the steps, in which a step that raises the Allan error is joined with the next, the last with the previous.

    Two effects that overlap in τ may together lower an error that one of them raises. A rise to at most the expected
    scatter does not count. Steps are joined only if the error does not rise over both.
    """
    found, waiting = [steps[0]], list(steps[1:])

    def rises(before: Rung, after: Rung) -> bool:
        """True if the Allan error rises from one step to another and exceeds its expected scatter."""
        return allan_error_rises(before.fit, after.fit) and not allan_error_within_scatter(
            after.fit
        )

    while waiting:
        step = waiting.pop(0)
        if rises(found[-1], step):
            if waiting and not rises(found[-1], waiting[0]):
                step = _joined(found[-1], step, waiting.pop(0))
            elif not waiting and len(found) > 1 and not rises(found[-2], step):
                step = _joined(found[-2], found.pop(), step)
        found.append(step)
    return tuple(found)


def _joined(before: Rung, first: Rung, second: Rung) -> Rung:
    """Step (`Rung`) that makes the changes of the steps `first` and `second` at once; it follows the step `before`."""
    return replace(
        second,
        added=first.added or second.added,
        removed=first.removed + second.removed,
        risen=first.risen_since(before) + second.risen_since(first),
        dropped_start=first.dropped_start + second.dropped_start,
        brought=(*first.brought, *(second.new if first.added else second.brought)),
        trials=first.trials if first.added else second.trials,
    )


def tried_and_dropped(ladder: Sequence[Rung]) -> tuple[Effect, ...]:
    """Tuple of the effects that the search added but the last model lacks, each kind once, as added last."""
    there = {e.kind for e in ladder[-1].fit.model}
    tried = {e.kind: e for rung in ladder for e in rung.new if e.kind not in there}
    return tuple(tried.values())


def _is_direct(ladder: Sequence[Rung]) -> bool:
    """True if the search dropped no added effect and none that came back, and raised no error beyond its scatter."""
    last = {effect.kind for effect in ladder[-1].fit.model}
    steps = itertools.pairwise(ladder)
    return all(
        len(rung.removed) == rung.dropped_start
        and not last & set(rung.removed)
        and no_error_rises(before.fit, rung.fit)
        for before, rung in steps
    )


def _kept_new_and_leaving(
    ladder: Sequence[Rung],
) -> tuple[list[Effect], list[Effect], list[Effect]]:
    """Tuple of three lists of effects: in both the first and the last model, only in the last, only in the first.

    A standard effect of the first model that was dropped and came back counts as kept.
    """
    last = state_of(ladder)
    leaving = [e for p, e in enumerate(ladder[0].fit.model) if p not in last.numbers]
    back = {e.kind for e in leaving if e.standard is not None}
    back &= {last.fit.model.effects[p].kind for p in last.added}
    kept = [e for p, e in enumerate(last.fit.model) if last.is_given(p) or e.kind in back]
    new = [e for p in last.added if (e := last.fit.model.effects[p]).kind not in back]
    return kept, new, [e for e in leaving if e.kind not in back]


def _by_gain(
    before: Fit, others: list[Effect], new: list[Effect], gains: dict[Effect, tuple[bool, float]]
) -> Iterator[Effect]:
    """Iterator over the effects `new`, best first: by the gain of a model with the effects `others` and one of them.

    Effects that lower the model discrepancy come first, then those with the highest ΔlogL. `gains` holds both of each
    effect in an earlier step, and is updated. Only the effect with the highest gain is evaluated again, because further
    effects seldom raise the gain of the others.
    """
    left, known = list(new), set[Effect]()
    while left:
        top = max(left, key=lambda effect: gains.get(effect, (True, np.inf)))
        if top in known:
            yield left.pop(left.index(top))
        else:
            solution = solve(before.data, Model((*others, top)), like=before.solution, polish=False)
            found = replace(before, model=solution.model, solution=solution)
            lowers = found.discrepancy.is_below(before.discrepancy)
            gains[top] = lowers, delta_logl(before, found)
            known.add(top)


def _fit_of_step(
    before: Fit, kept: list[Effect], leaving: list[Effect]
) -> tuple[Fit, list[Effect]]:
    """Pair (fit, removed): `Fit` of the model with the effects `kept` and those of `leaving` that are still needed.

    An effect of `leaving` is removed if the log evidence is not lower without it.
    """
    fit = refitted(before, Model((*kept, *leaving)))
    dropped: list[Effect] = []
    for effect in leaving:
        still = [e for e in leaving if e is not effect and e not in dropped]
        less = refitted(fit, Model((*kept, *still)))
        if evidence(less.solution) >= evidence(fit.solution):
            fit, dropped = less, [*dropped, effect]
    return fit, dropped


def _step_with_record(
    ladder: Sequence[Rung], fit: Fit, new: list[Effect], dropped: list[Effect]
) -> Rung:
    """`Rung` of the step to `fit`, which adds the effects `new` and removes the effects `dropped`.

    `trials` is that of the first step of `ladder` that added an effect of the kind of `new[0]`; None without such a step.
    `risen` (ΔlogL) comes from that step if `new[0]` is an exclusion, a change of level or a moving band, otherwise it is
    None.
    """
    known = next((r for r in ladder if any(e.kind == new[0].kind for e in r.new)), None)
    # The mean spectrum does not show exclusions, levels over time and moving bands, so the search's ΔlogL is used.
    elsewhere = excludes_or_changes_level(new[0]) or new[0].moving
    risen = known.risen if known is not None and elsewhere else None
    trials = known.trials if known is not None else None
    kinds = tuple(e.kind for e in dropped)
    return Rung(
        fit,
        added=new[0],
        removed=kinds,
        risen=risen,
        dropped_start=len(kinds),
        brought=tuple(new[1:]),
        trials=trials,
    )

"""The steps that users read: the last model built up from the first, without the detours of the search."""

from __future__ import annotations

import itertools
from collections import Counter
from typing import TYPE_CHECKING

from allanite.effects import Model, Modifier, Moving
from allanite.fit import refitted, removes
from allanite.fit.engine import solve
from allanite.fit.rivals.evidence import evidence
from allanite.study.error_comparison import errors_fall, rises
from allanite.study.ladder import Rung

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["dropped_on_the_way", "story"]


def story(ladder: Sequence[Rung]) -> tuple[Rung, ...]:
    """The same first and last fit, with the effects of the last model added one after the other.

    Each step adds the effect that raises logL most among those that do not raise the Allan error, or raise no error beyond
    its scatter; where there are none, the rest comes at once. Samples are excluded first. An effect of the start that the
    last model lacks leaves as soon as the evidence rises without it. A search that never took back what it added, and never
    raised an error beyond its scatter, is its own story.
    """
    if _is_direct(ladder):
        return tuple(ladder)
    last = ladder[-1].fit
    kept, new, leaving = _compared(ladder[0].fit.model, last.model)
    found = [ladder[0]]
    while new:
        before = found[-1].fit
        masks = [e for e in new if removes(e)]
        tolerable: list[tuple[Effect, Fit, list[Effect]]] = []
        for effect in masks[:1] or _by_gain(before, kept, leaving, new):
            fit, gone = last, leaving
            if len(new) > 1:
                fit, gone = _step(before, [*kept, effect], leaving)
            if masks or len(new) == 1 or errors_fall(before, fit):
                tolerable.append((effect, fit, gone))
                if not rises(before, fit):
                    break
        if not tolerable:
            found.append(_rung(ladder, last, new, leaving))
            break
        effect, fit, gone = tolerable[0] if rises(before, tolerable[-1][1]) else tolerable[-1]
        found.append(_rung(ladder, fit, [effect], gone))
        kept, new = [*kept, effect], [e for e in new if e is not effect]
        leaving = [e for e in leaving if e not in gone]
    return tuple(found)


def dropped_on_the_way(ladder: Sequence[Rung]) -> tuple[Effect, ...]:
    """Effects that a search added and took back, of kinds that the last model lacks."""
    there = {e.kind for e in ladder[-1].fit.model}
    tried = {e.kind: e for rung in ladder for e in rung.new if e.kind not in there}
    return tuple(tried.values())


def _is_direct(ladder: Sequence[Rung]) -> bool:
    steps = itertools.pairwise(ladder)
    return all(
        len(rung.removed) == rung.dropped_start and errors_fall(before.fit, rung.fit)
        for before, rung in steps
    )


def _compared(first: Model, last: Model) -> tuple[list[Effect], list[Effect], list[Effect]]:
    """Effects of the last model that the first has, those that it lacks, and those of the first that the last lacks."""
    both = Counter(e.kind for e in first) & Counter(e.kind for e in last)
    left = both.copy()
    kept: list[Effect] = []
    new: list[Effect] = []
    for effect in last:
        (kept if left[effect.kind] else new).append(effect)
        left[effect.kind] -= left[effect.kind] > 0
    leaving = []
    for effect in first:
        if both[effect.kind]:
            both[effect.kind] -= 1
        else:
            leaving.append(effect)
    return kept, new, leaving


def _by_gain(
    before: Fit, kept: list[Effect], leaving: list[Effect], new: list[Effect]
) -> list[Effect]:
    """The new effects by their rise of logL beside those that are there, at the shapes of the last model."""

    def gain(effect: Effect) -> float:
        model = Model((*kept, *leaving, effect))
        return solve(before.data, model, like=before.solution, polish=False).log_likelihood

    return sorted(new, key=gain, reverse=True)


def _step(before: Fit, kept: list[Effect], leaving: list[Effect]) -> tuple[Fit, list[Effect]]:
    """The fit of a step, and the effects of the start that leave with it."""
    fit = refitted(before, Model((*kept, *leaving)))
    gone: list[Effect] = []
    for effect in leaving:
        still = [e for e in leaving if e is not effect and e not in gone]
        less = refitted(fit, Model((*kept, *still)))
        if evidence(less.solution) >= evidence(fit.solution):
            fit, gone = less, [*gone, effect]
    return fit, gone


def _rung(ladder: Sequence[Rung], fit: Fit, new: list[Effect], gone: list[Effect]) -> Rung:
    """A step with what the search knew of its first effect."""
    known = next((r for r in ladder if any(e.kind == new[0].kind for e in r.new)), None)
    # The mean spectrum does not know what is excluded, how loud a sensor is at a time, and what moves: the search does.
    in_time = isinstance(new[0], Modifier) and (new[0].removes or new[0].passing)
    elsewhere = in_time or isinstance(new[0], Moving)
    risen = known.risen if known is not None and elsewhere else None
    trials = known.trials if known is not None else None
    kinds = tuple(e.kind for e in gone)
    return Rung(fit, new[0], kinds, risen, len(kinds), tuple(new[1:]), trials)

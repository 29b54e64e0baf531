"""Whether two effects stand where one stood for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Model
from allanite.fit import refitted
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.columns import follow_columns_consistently
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.rivals.together import can_be_split
from allanite.study.drop_and_replace import one_thing
from allanite.suggestion.constants import MAX_PAIRS_REFITTED

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["parted"]


def parted(fit: Fit, places: Iterable[int]) -> tuple[Fit, int, tuple[Effect, ...]] | None:
    """The fit with two effects that together stand clearly better than one, the place of that one, and the two.

    The first of `places` of which this holds. Taken is the plainest of what the record cannot tell from the best: of the
    models with the pairs, with one of a pair alone, which then is all that comes, and with the one and either of a pair
    beside it, which is left to a rung of its own. Of those with as many numbers the one with the fewest refined
    forms, then the one whose Allan curve is nearest. What only describes gives way unless it is clearly better.
    """
    for place in places:
        out = fit.model.effects[place]
        if not can_be_split(out):
            continue
        pairs = [
            pair
            for pair in fit.together(place)
            if not any(
                one_thing(old, new, fit) for old in fit.model for new in pair.model.effects[-2:]
            )
        ]
        # The best of many is ahead by chance.
        least = (
            -MAX_RIVAL_LOG_EVIDENCE
            if out.last_resort
            else MAX_RIVAL_LOG_EVIDENCE + float(np.log(max(len(pairs), 1)))
        )
        found = [
            refitted(fit, p.model)
            for p in pairs[:MAX_PAIRS_REFITTED]
            if p.evidence > least - MAX_RIVAL_LOG_EVIDENCE
        ]
        count = len(fit.model) - 1
        found = [f for f in found if _better(f, fit) > least and _consistent(f, count)]
        if not found:
            continue
        # Of two the record may need but one.
        alone = [
            refitted(fit, Model((*f.model.effects[:count], part)))
            for f in found
            for part in f.model.effects[count:]
        ]
        beside: list[Fit] = []
        if not out.last_resort:
            parts = {e.kind: e for f in found for e in f.model.effects[count:]}.values()
            beside = [refitted(fit, fit.model + part) for part in parts]
        every = [(_better(f, fit), f) for f in (*found, *alone, *beside) if _consistent(f, count)]
        top = max(gain for gain, _ in every)
        near = [(gain, f) for gain, f in every if gain > top - MAX_RIVAL_LOG_EVIDENCE]
        gain, plainest = min(near, key=lambda each: _plainness(each[1]))
        came = range(count, len(plainest.model))
        if plainest not in beside and gain > least and all(is_detected(plainest, p) for p in came):
            return plainest, place, plainest.model.effects[count:]
    return None


def _consistent(fit: Fit, count: int) -> bool:
    """Whether no column among the effects after the first `count` is like the samples by chance."""
    return follow_columns_consistently(fit.model.effects[count:], fit.solution, fit.data)


def _better(after: Fit, before: Fit) -> float:
    return evidence_gain(after.solution, before.solution, before.data)


def _plainness(fit: Fit) -> tuple[int, int, float]:
    """Fewest numbers, then fewest refined forms, then the nearest Allan curve."""
    refined = sum(e.refined for e in fit.model.deterministic)
    return sum(e.numbers for e in fit.model), refined, fit.curve.rms_percent or 0.0

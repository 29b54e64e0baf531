"""Whether two effects stand where one stood for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Model
from allanite.fit import refitted
from allanite.fit.rivals.columns import consistent
from allanite.fit.rivals.evidence import RIVAL, evidence
from allanite.fit.rivals.together import splits
from allanite.study.moves import one_thing

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["parted"]

#: Best of the pairs that are fitted wholly.
REFITTED = 3


def parted(fit: Fit, places: Iterable[int]) -> tuple[Fit, int, tuple[Effect, ...]] | None:
    """The fit with two effects that together stand clearly better than one, the place of that one, and the two.

    The first of `places` of which this holds. Taken is the plainest of what the record cannot tell from the best: of the
    models with the pairs, with one of a pair alone, which then is all that comes, and with the one and either of a pair
    beside it, which is left to a rung of its own. Of those with as many numbers the one whose Allan curve is
    nearest. What only describes gives way unless it is clearly better.
    """
    for place in places:
        out = fit.model.effects[place]
        if not splits(out):
            continue
        had = evidence(fit.solution)
        least = had - RIVAL if out.last_resort else had + RIVAL
        pairs = [
            pair
            for pair in fit.together(place)
            if not any(
                one_thing(old, new, fit) for old in fit.model for new in pair.model.effects[-2:]
            )
        ]
        found = [
            refitted(fit, p.model) for p in pairs[:REFITTED] if had + p.evidence > least - RIVAL
        ]
        found = [
            f
            for f in found
            if evidence(f.solution) > least and consistent(f.model.effects[-2:], f.solution, f.data)
        ]
        if not found:
            continue
        # Of two the record may need but one.
        count = len(fit.model) - 1
        alone = [
            refitted(fit, Model((*f.model.effects[:count], part)))
            for f in found
            for part in f.model.effects[count:]
        ]
        beside: list[Fit] = []
        if not out.last_resort:
            parts = {e.kind: e for f in found for e in f.model.effects[count:]}.values()
            beside = [refitted(fit, fit.model + part) for part in parts]
        every = [*found, *alone, *beside]
        top = max(evidence(f.solution) for f in every)
        plainest = min(
            (f for f in every if evidence(f.solution) > top - RIVAL),
            key=lambda f: (sum(e.numbers for e in f.model), f.curve.rms_percent or 0.0),
        )
        if plainest not in beside and evidence(plainest.solution) > least:
            return plainest, place, plainest.model.effects[count:]
    return None

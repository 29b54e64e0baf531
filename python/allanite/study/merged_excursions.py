"""Where the bias leaves and comes back, further times are looked for at once, and one effect says so."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOGUE, Away, Model, Stochastic
from allanite.fit import refitted
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.shapes.matched import slow_families
from allanite.study.error_comparison import as_good
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY, MAX_EXCURSIONS
from allanite.suggestion.p_values import Family, log_p_value
from allanite.suggestion.screens.slow_functions import judged_beside_best, score, screen_slow

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution
    from allanite.suggestion import Suggestion

__all__ = ["every_visit"]


def every_visit(
    fit: Fit, asked: int, suggestions: Sequence[Suggestion]
) -> tuple[Fit, tuple[str, ...]] | None:
    """The fit with one effect in the place of those after the first `asked` by which the bias leaves and comes back.

    And of those that are still missing: one says nothing of another, each has samples of its own. What is taken in explains
    more than any other slow function, and something that the best random process of the `suggestions` does not; together
    they leave a model as good. With the kinds of the effects that were there before the last; None where one is all there
    is.
    """
    known = [e for e in fit.model.effects[asked:] if isinstance(e, Away)]
    rest = Model(tuple(e for e in fit.model if e not in known))
    events = list(known)
    wandering = [s for s in suggestions if isinstance(s.effect, Stochastic) and s.effect.wanders]
    rival = max(wandering, key=lambda s: s.delta_log_likelihood, default=None)
    solution = fit.solution
    while sum(len(e.singly) for e in events) < MAX_EXCURSIONS:
        beside = None
        if rival is not None:
            beside = solve(fit.data, solution.model + rival.effect, like=solution, polish=False)
        further = _missing(solution, fit.data, beside)
        if further is None or any(_overlap(further, e) for e in events):
            break  # what overlaps is of the shape of one that is known
        events.append(further)
        model = solution.model + further
        solution = solve(fit.data, model, like=solution, polish=False, rounds=4)
    kinds = tuple(e.kind for e in known[:-1])
    for visits in (events, known) if len(events) > len(known) else (known,):
        one = _together(visits) if len(visits) > 1 else None
        if one is not None:
            whole = refitted(fit, rest + one)
            if visits is known or as_good(fit, whole):
                return whole, kinds
    return None


def _together(events: Sequence[Away]) -> Away | None:
    """The effect of the catalogue that is all of them."""
    kinds = (cls for cls in CATALOGUE if issubclass(cls, Away))
    return next((one for cls in kinds if (one := cls.together(events)) is not None), None)


def _overlap(one: Away, event: Away) -> bool:
    (start, end), *_ = _times(one)
    return any(start < last and end > first for first, last in _times(event))


def _times(event: Away) -> list[tuple[float, float]]:
    return [e.when for e in event.singly if e.when is not None]


def _missing(solution: Solution, data: Data, rival: Solution | None) -> Away | None:
    """The excursion that is missing, if of all slow functions it explains most, and more than chance does."""
    slow = slow_families(solution.model, data.covariates)
    whitened = cache(lambda: whiten(solution, data))
    screens = {
        name: screen_slow(blanks, solution, data, rival, whitened)
        for name, blanks in sorted(slow.items())
    }
    screens = judged_beside_best(screens, data)
    found = [c for screen in screens.values() for c in screen.candidates]
    if not found:
        return None
    best = max(found, key=score)
    if not isinstance(best.effect, Away):
        return None
    judged = best.gain if best.judged is None else best.judged
    chance = log_p_value(Family(best.family, screens[best.family].arcs, sides=2), judged)
    return best.effect if chance + np.log(len(slow)) < np.log(FALSE_ALARM_PROBABILITY) else None

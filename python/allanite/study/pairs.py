"""Two effects where one stood for both: a walk for a step beside a ramp, a second lag for a walk beside a temperature."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Stochastic
from allanite.fit import refitted
from allanite.fit.alternatives import RIVAL, price
from allanite.fit.engine import solve
from allanite.fit.shapes.matched import grid_points, matched_gains
from allanite.study.moves import one_thing
from allanite.suggestion.drifts import slow_families

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.engine import Solution
    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.suggestion import Check

__all__ = ["parted"]

#: Suggestions of which pairs are tried.
TRIED = 6
#: Best of these pairs that are fitted wholly; of those that say the same the one with the fewest numbers is taken.
REFITTED = 3
#: What the noise, refitted with a slow function, may add to its gain.
HOPE = 10.0


def parted(check: Check, better: Fit, added: Effect) -> tuple[Fit, Effect, Effect] | None:
    """The fit with two effects that together stand clearly better than the one that was added, and these two.

    Two suggestions, of which one may be taken for the added effect; in the place of a process that wanders, a suggestion
    and the slow function that shows beside it. The pair has to beat the added one alone and with either of
    the two beside it: what is missing as well has a rung of its own.
    """
    if added.screened == "line":
        return None  # nothing else is as narrow
    fit = check.fit
    cost = price(fit)
    before = fit.solution.log_likelihood
    risen = better.solution.log_likelihood - before

    def evidence(solution: Solution) -> float:
        return solution.log_likelihood - cost * sum(effect.numbers for effect in solution.model)

    least = evidence(better.solution) + RIVAL
    others = sorted(
        (s for s in check.suggestions if s.effect is not added and _stands_alone(s.effect, fit)),
        key=lambda s: -s.rank,
    )[:TRIED]
    of_two = [
        (one.solution, other.effect)
        for one, other in combinations(others, 2)
        if sum(s.solution.log_likelihood - before for s in (one, other)) >= risen
        and (one.effect.may_be(added) or other.effect.may_be(added))
    ]
    if isinstance(added, Stochastic) and (added.wanders or added.last_resort):
        of_two += [
            (one.solution, other)
            for one in [s for s in others if s.effect.screened == "slow"][:REFITTED]
            for other in _beside(one.solution, fit.data, least, cost)
        ]
    tried = [
        solve(fit.data, start.model + other, like=start, polish=False) for start, other in of_two
    ]
    tried = sorted((s for s in tried if evidence(s) > least), key=evidence)[::-1][:REFITTED]
    if not tried:
        return None
    found = [refitted(fit, solution.model) for solution in tried]
    top = max(evidence(f.solution) for f in found)
    alike = [f for f in found if evidence(f.solution) > top - RIVAL]
    best = min(alike, key=lambda f: sum(effect.numbers for effect in f.model))
    first, second = best.model.effects[-2:]
    beside = [refitted(fit, better.model + effect) for effect in (first, second)]
    if evidence(best.solution) < max(evidence(f.solution) for f in beside) + RIVAL:
        return None
    return best, first, second


def _beside(one: Solution, data: Data, least: float, cost: float) -> list[Effect]:
    """The best form of each slow function that may lift a model above `least`: two that hide each other show together."""
    found: list[Effect] = []
    noise = one.noise(data)
    had = one.log_likelihood - cost * sum(effect.numbers for effect in one.model)
    for blanks in slow_families(one.model, data.covariates).values():
        for blank in blanks:
            points = grid_points(blank, data)
            gains, _ = matched_gains(points, one.ordinates, noise, data, one.model.deterministic)
            top = int(np.argmax(gains))
            if had + gains[top] - cost * blank.numbers > least - HOPE:
                found.append(points[top])
    return found


def _stands_alone(effect: Effect, fit: Fit) -> bool:
    """Whether the whole record shows an effect, and no line or band that is there is the same.

    A power law only describes what others explain.
    """
    shown = effect.screened in {"spectral", "slow", "line"} and not effect.last_resort
    return shown and not any(one_thing(other, effect, fit) for other in fit.model)

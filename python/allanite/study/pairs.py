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
from allanite.suggestion.spectral import screen_spectral

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
#: What shapes and the noise, refitted with both of a pair, may add to its gain.
HOPE = 10.0


def parted(check: Check, better: Fit, added: Effect) -> tuple[Fit, Effect, Effect] | None:
    """The fit with two effects that together stand clearly better than the one that was added, and these two.

    Two suggestions, of which one may be taken for the added effect; in the place of a process that wanders, a suggestion
    and the slow function that shows beside it; in the place of one that only describes, two processes that may make it
    up, the second at the shape that shows beside the first. The pair has to beat the added one alone and with either of
    the two beside it, or to come near to one that only describes: what is missing as well has a rung of its own.
    """
    if added.screened == "line":
        return None  # nothing else is as narrow
    fit = check.fit
    cost = price(fit)
    before = fit.solution.log_likelihood
    risen = better.solution.log_likelihood - before

    def evidence(solution: Solution) -> float:
        return solution.log_likelihood - cost * sum(effect.numbers for effect in solution.model)

    # What only describes gives way to two that explain unless it is clearly better.
    clear = -RIVAL if added.last_resort else RIVAL
    least = evidence(better.solution) + clear
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
    if added.last_resort:
        processes = [s for s in others if isinstance(s.effect, Stochastic)]
        processes = [s for s in processes if s.effect.may_be(added)][:REFITTED]
        tried += [
            pair for one in processes for pair in _processes_beside(one.solution, added, fit.data)
        ]
    # A shape found while one effect stood for two moves when both are there.
    hopeful = sorted((s for s in tried if evidence(s) > least - HOPE), key=evidence)
    found = [refitted(fit, solution.model) for solution in hopeful[::-1][:REFITTED]]
    found = [f for f in found if evidence(f.solution) > least]
    top = max((evidence(f.solution) for f in found), default=0.0)
    # Of those that say the same the one with the fewest numbers first.
    found.sort(
        key=lambda f: (
            evidence(f.solution) <= top - RIVAL,
            sum(effect.numbers for effect in f.model),
            -evidence(f.solution),
        )
    )
    for pair in found:
        first, second = pair.model.effects[-2:]
        beside = [refitted(fit, better.model + effect) for effect in (first, second)]
        if evidence(pair.solution) > max(evidence(f.solution) for f in beside) + clear:
            return pair, first, second
    return None


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


def _processes_beside(one: Solution, added: Effect, data: Data) -> list[Solution]:
    """The model with each process that may be a part of the added one, at the shape that shows beside it."""
    found = [c for c in screen_spectral(one, data).candidates if not c.effect.last_resort]
    return [c.solution for c in found if c.solution is not None and c.effect.may_be(added)]


def _stands_alone(effect: Effect, fit: Fit) -> bool:
    """Whether the whole record shows an effect, and no line or band that is there is the same.

    A power law only describes what others explain.
    """
    shown = effect.screened in {"spectral", "slow", "line"} and not effect.last_resort
    return shown and not any(one_thing(other, effect, fit) for other in fit.model)

"""Two effects where one stood for both: a walk for a step beside a ramp, a second lag for a walk beside a temperature."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from allanite.fit import refitted
from allanite.fit.alternatives import RIVAL, price
from allanite.fit.engine import solve

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.engine import Solution
    from allanite.fit.result import Fit
    from allanite.suggestion import Check
    from allanite.suggestion.suggest import Suggestion

__all__ = ["parted"]

#: Suggestions of which pairs are tried.
TRIED = 6
#: Best of these pairs that are fitted wholly; of those that say the same the one with the fewest numbers is taken.
REFITTED = 3


def parted(check: Check, better: Fit, added: Effect) -> tuple[Fit, Effect, Effect] | None:
    """The fit with the two suggestions that together stand clearly better than the one that was added, and these two.

    One of the two is what may be taken for the added effect. The pair has to beat the added one alone and with either of
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

    others = sorted(
        (s for s in check.suggestions if s.effect is not added and _in_the_mean(s.effect)),
        key=lambda s: -s.rank,
    )
    least = evidence(better.solution) + RIVAL
    pairs: list[tuple[float, Suggestion, Suggestion, Solution]] = []
    for one, other in combinations(others[:TRIED], 2):
        if sum(s.solution.log_likelihood - before for s in (one, other)) < risen:
            continue
        if not (one.effect.may_be(added) or other.effect.may_be(added)):
            continue
        model = one.solution.model + other.effect
        both = solve(fit.data, model, like=one.solution, polish=False)
        if evidence(both) > least:
            pairs.append((evidence(both), one, other, both))
    if not pairs:
        return None
    pairs = sorted(pairs, key=lambda pair: -pair[0])[:REFITTED]
    found = [refitted(fit, both.model) for *_, both in pairs]
    top = max(evidence(f.solution) for f in found)
    alike = [f for f in found if evidence(f.solution) > top - RIVAL]
    best = min(alike, key=lambda f: sum(effect.numbers for effect in f.model))
    _, one, other, _ = pairs[found.index(best)]
    beside = [refitted(fit, better.model + s.effect) for s in (one, other)]
    if evidence(best.solution) < max(evidence(f.solution) for f in beside) + RIVAL:
        return None
    first, second = best.model.effects[-2:]
    return best, first, second


def _in_the_mean(effect: Effect) -> bool:
    """Whether the whole record shows an effect; a power law only describes what others explain."""
    return effect.screened in {"spectral", "slow", "line"} and not effect.last_resort

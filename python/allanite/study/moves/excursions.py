"""Merge excursions: search for all further excursions of the bias, and describe all by one effect."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import BiasStep, Deterministic, Model, Stochastic
from allanite.fit import refitted
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.shapes.matched import slow_families
from allanite.study.judgement import is_as_good
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY, MAX_EVENTS
from allanite.suggestion.p_values import log_p_value
from allanite.suggestion.screens.several_excursions import excursions_overlap, merged_excursions
from allanite.suggestion.screens.slow_functions import score, screen_slow

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened
    from allanite.fit.solution import Solution
    from allanite.study.state import State
    from allanite.suggestion import Suggestion


def with_all_excursions(
    before: State, suggestions: Sequence[Suggestion], known_only: bool = False
) -> State | None:
    """`State` with one effect for all excursions (short events), added by the search or still missing; or None.

    Further excursions are searched, up to 32 in all, unless `known_only`. Each must explain more than any other slow
    function, and something beyond the best slowly drifting random process of the `suggestions`. If the model with them
    is not as good (`is_as_good`), only the added ones are merged. None if fewer than two remain to be merged.
    """
    fit = before.fit
    places = [p for p in before.added if fit.model.effects[p].returns]
    known = [e for p in places if isinstance(e := fit.model.effects[p], Deterministic)]
    others = Model(tuple(e for p, e in enumerate(fit.model) if p not in places))
    events = list(known)
    wandering = [s for s in suggestions if isinstance(s.effect, Stochastic) and s.effect.wanders]
    rival = max(wandering, key=lambda s: s.delta_log_likelihood, default=None)
    solution = fit.solution
    # Further excursions elsewhere do not change the samples of an event.
    whitened = cache(lambda: whiten(fit.solution, fit.data))
    while not known_only and sum(len(e.singly) for e in events) < MAX_EVENTS:
        with_rival = None
        if rival is not None:
            with_rival = solve(fit.data, solution.model + rival.effect, like=solution, polish=False)
        further = _missing_excursion(solution, fit.data, with_rival, whitened)
        if further is None or any(excursions_overlap(further, e) for e in events):
            break  # an overlapping one is a flaw of a known excursion's shape
        events.append(further)
        model = solution.model + further
        solution = solve(fit.data, model, like=solution, polish=False, rounds=4)
    for visits in (events, known) if len(events) > len(known) else (known,):
        one = merged_excursions(visits) if len(visits) > 1 else None
        if one is not None:
            whole = refitted(fit, others + one)
            if visits is known or is_as_good(fit, whole):
                return before.after(whole, places)
    return None


def _missing_excursion(
    solution: Solution, data: Data, rival: Solution | None, whitened: Callable[[], Whitened]
) -> Deterministic | None:
    """Excursion that the model lacks and that explains more than all other slow functions; or None.

    None if another slow function explains more, or if it has a p-value above 1 %. `rival` is the solution with the best
    slowly drifting random process, `whitened` returns the whitened record of the search.
    """
    # Excursions are pairs of steps. Only a significant one is compared with the other functions.
    families = slow_families(solution.model, data.covariates)
    steps = screen_slow(solution, data, rival, whitened, {BiasStep.family})
    best = max(steps, key=score, default=None)
    if best is None or not (isinstance(best.effect, Deterministic) and best.effect.returns):
        return None
    judged = best.gain if best.judged_gain is None else best.judged_gain
    log_p = log_p_value(best.family, judged) + np.log(len(families))
    if log_p >= np.log(FALSE_ALARM_PROBABILITY):
        return None
    others = screen_slow(solution, data, rival, whitened, families.keys() - {BiasStep.family})
    return best.effect if all(score(other) < score(best) for other in others) else None

"""Drop: remove effects that the last addition makes needless, and added effects that cost more than they explain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Model
from allanite.fit import refitted, removes
from allanite.fit.engine import solve
from allanite.fit.rivals.alternatives import MAX_POLISH_DELTA_LOGL, is_detected, is_removable
from allanite.fit.rivals.evidence import bic_cost, evidence_gain
from allanite.study.judgement import is_as_good, no_error_rises
from allanite.suggestion.constants import MAIN_SHARE, MIN_SCORE_GAIN
from allanite.suggestion.ranking import prior

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from allanite.fit.result import Fit
    from allanite.study.state import State


def without_needless(before: State, after: State, needed: Collection[str]) -> State | None:
    """State without the effects that the last addition makes needless; None if all stay.

    They stay if an error rises without them, unless the record shows none of them. Kinds in `needed` stay.
    """
    less = without_needless_effects(before, after, needed)
    lost = less.lost_since(after)
    if not lost:
        return None
    undetected = not any(is_detected(after.fit, place) for place in lost)
    good = is_as_good(after.fit, less.fit) or (undetected and no_error_rises(after.fit, less.fit))
    return less if good else None


def without_needless_effects(before: State, after: State, needed: Collection[str]) -> State:
    """State without the effects whose loss of logL is below their limit, the last ones first.

    An effect of the user's model is removed if it explains nothing, an added one if it explains less than part of its
    cost. The interval of a function of time depends on the slow noise of the user's model, which therefore stays.
    """
    state = after
    slow = isinstance(after.fit.model.effects[-1], Deterministic)
    for number in reversed(after.numbers[:-1]):
        place = state.numbers.index(number)
        effect = state.fit.model.effects[place]
        if not is_removable(effect) or effect.kind in needed:
            continue
        least = MAIN_SHARE * effect.numbers * bic_cost(state.fit.solution)
        if state.is_given(place):
            if slow or not is_detected(before.fit, before.numbers.index(number)):
                continue
            least = MIN_SCORE_GAIN
        without = _without(state.fit, place, least)
        if without is not None:
            state = state.after(without, (place,))
    return state


def _without(fit: Fit, place: int, least: float) -> Fit | None:
    """Fit without an effect, if that loses less than `least` of logL; else None."""
    effects = fit.model.effects
    less = Model(effects[:place] + effects[place + 1 :])
    if effects[place].screened not in {"spectral", "slow", "line"} and is_detected(fit, place):
        return None  # the evidence of events in time is not in the mean spectrum
    # With fixed shapes the loss is an upper bound. If it is far above the limit, the full fit is not needed.
    rough = (
        solve(fit.data, less, like=fit.solution, polish=False)
        if not removes(effects[place])
        else None
    )
    if (
        rough is not None
        and fit.solution.log_likelihood - rough.log_likelihood > least + MAX_POLISH_DELTA_LOGL
    ):
        return None
    found = refitted(fit, less)
    lost = fit.solution.log_likelihood - found.solution.log_likelihood
    return found if lost < least else None


def drops(state: State, needed: Collection[str]) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Models without one added effect: promised gain, place that leaves, model. Kinds in `needed` stay."""
    fit = state.fit
    for place in state.added:
        effect = fit.model.effects[place]
        shown = effect.screened in {"spectral", "slow", "line"}
        if shown and is_removable(effect) and effect.kind not in needed:
            less = Model(tuple(e for p, e in enumerate(fit.model) if p != place))
            rough = solve(fit.data, less, like=fit.solution, polish=False)
            yield evidence_gain(rough, fit.solution, fit.data) - prior(effect), (place,), less

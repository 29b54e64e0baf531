"""Drop: remove effects that the last addition makes needless, and added effects that cost more than they explain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Model
from allanite.fit import refitted
from allanite.fit.estimates import min_detected_delta_logl
from allanite.fit.models import without_effect
from allanite.fit.rivals.alternatives import (
    MAX_POLISH_DELTA_LOGL,
    is_detected,
    is_removable,
    solution_without,
)
from allanite.fit.rivals.evidence import evidence_gain
from allanite.fit.rivals.score import prior
from allanite.fit.solution import Regressed, Solution
from allanite.study.judgement import is_as_good, no_error_rises
from allanite.suggestion.constants import MIN_SCORE_GAIN

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from allanite.fit.result import Fit
    from allanite.study.state import State


def without_needless(before: State, after: State, needed: Collection[str]) -> State | None:
    """`State` without the effects that the last addition makes needless; None if no effect is removed.

    No effect is removed if an error would rise beyond its scatter, or if a needless effect is detected and the Allan error
    would rise above its expected scatter. Kinds in `needed` are never needless.
    """
    less = without_needless_effects(before, after, needed)
    lost = less.lost_since(after)
    if not lost:
        return None
    undetected = not any(is_detected(after.fit, place) for place in lost)
    good = is_as_good(after.fit, less.fit) or (undetected and no_error_rises(after.fit, less.fit))
    return less if good else None


def without_needless_effects(before: State, after: State, needed: Collection[str]) -> State:
    """`State` of `after` without its needless effects; `after` itself if all effects are needed.

    `before` is the state without the last effect of `after`. The other effects are tried from the last to the first. An
    effect is dropped if it may be dropped (`_may_be_dropped`) and is needless (`_fit_if_needless`). An effect of the user's
    model must also have been detected in `before`; all of them stay if the last effect is a function of time. A line that
    is needed as in `before` stays (`_is_line_needed_as_before`). Effects of kinds in `needed` stay, too.
    """
    state = after
    slow = isinstance(after.fit.model.effects[-1], Deterministic)
    detected = [n for at, n in enumerate(before.numbers) if is_detected(before.fit, at)]
    for number in reversed(after.numbers[:-1]):
        place = state.numbers.index(number)
        given = state.is_given(place)
        stays = given and (slow or number not in detected)
        if stays or _is_line_needed_as_before(before, state, number):
            continue
        if _may_be_dropped(state.fit, place, needed):
            without = _fit_if_needless(state.fit, place, given)
            if without is not None:
                state = state.after(without, (place,))
    return state


def _is_line_needed_as_before(before: State, after: State, number: int) -> bool:
    """True if the effect with this `number` is a line in both states, and `after` still needs the line.

    The gain of the score if the line is dropped, with all shapes fixed, must not rise by 0.5 nats or more from `before` to
    `after`.
    """
    place = after.numbers.index(number)
    if number not in before.numbers or not after.fit.model.effects[place].periodic:
        return False
    earlier = before.numbers.index(number)
    old = gain_without(before.fit, earlier, solution_without(before.fit, earlier))
    new = gain_without(after.fit, place, solution_without(after.fit, place))
    return new < old + MIN_SCORE_GAIN


def models_with_one_dropped(
    state: State, needed: Collection[str]
) -> Iterator[tuple[float, tuple[int, ...], Model, float]]:
    """Iterator over (expected gain, (index,), model, prior): a model without each added effect that may be dropped.

    The gain is the expected rise of the score, nats (`gain_without`): that of the log evidence plus `prior`, that of the
    priors. No effect of a kind in `needed` is dropped.
    """
    fit = state.fit
    for place in state.added:
        if _may_be_dropped(fit, place, needed):
            gain = gain_without(fit, place, solution_without(fit, place))
            absent = -min(prior(fit.model.effects[place]), 0.0)
            yield gain, (place,), without_effect(fit.model, place), absent


def gain_without(fit: Fit, place: int, less: Solution) -> float:
    """Rise of the score, nats, if the effect at index `place` is dropped; positive if the model without it is better.

    The rise is that of the log evidence of `less`, minus the prior of the effect; positive priors count as 0.
    """
    return evidence_gain(less, fit.solution, fit.data) - min(prior(fit.model.effects[place]), 0.0)


def _may_be_dropped(fit: Fit, place: int, needed: Collection[str]) -> bool:
    """True if the search may drop the effect at index `place`: removable and not of a `needed` kind.

    An effect that is not found in the mean spectrum, such as an event or an exclusion, must also be undetected.
    """
    effect = fit.model.effects[place]
    in_spectrum = effect.is_tried_in_spectrum() or effect.periodic
    is_slow = isinstance(effect, Deterministic) and effect.low
    return (
        (in_spectrum or is_slow or not is_detected(fit, place))
        and is_removable(effect)
        and effect.kind not in needed
    )


def _fit_if_needless(fit: Fit, place: int, given: bool) -> Fit | None:
    """`Fit` without the effect at index `place` if the model does not need this effect; None if it does.

    A detected added effect is needless if the score rises by more than 0.5 nats without it (`gain_without`). An undetected
    added effect is needless if logL falls by less than a detected effect must bring (`min_detected_delta_logl`). An effect
    of the user's model (`given`) is needless if logL falls by less than 0.5 nats without it.
    """
    own, least = fit.solution.effects[place], MIN_SCORE_GAIN
    if undetected := not given and not is_detected(fit, place):
        amplitudes = own.amplitudes.size if isinstance(own, Regressed) else 1
        least = min_detected_delta_logl(own.effect, amplitudes)

    def gains(less: Solution) -> float:
        """Amount, nats, by which a solution without the effect exceeds the limit for dropping it; positive if needless."""
        if given or undetected:
            return less.log_likelihood - fit.solution.log_likelihood + least
        return gain_without(fit, place, less) - MIN_SCORE_GAIN

    less = without_effect(fit.model, place)
    # With fixed shapes the gain is a lower bound. If it is far below the limit, the full fit is not needed.
    if gains(solution_without(fit, place)) < -MAX_POLISH_DELTA_LOGL:
        return None
    found = refitted(fit, less)
    return found if gains(found.solution) > 0.0 else None

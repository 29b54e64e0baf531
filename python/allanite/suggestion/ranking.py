"""The order of suggestions: by evidence; at a tie the plain one first."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Deterministic, Model, Modifier, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.rivals.evidence import RIVAL, cost
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAX_EXPLAINED_REMAINDER,
    MIN_DISTURBANCE_DELTA_LOGL,
    MIN_OUTLIERS_PER_CLUSTER,
    MIN_OVERDISPERSION_LEVEL_FIRST,
    MIN_SCORE_RATIO_AHEAD,
    OUTLIER_CLUSTER_DIVISOR,
)
from allanite.suggestion.screens.exclusions import at_the_ends, differs_by, only_at_the_ends

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion

__all__ = ["in_order"]


def in_order(found: Iterable[Suggestion], fit: Fit, crowded: float) -> tuple[Suggestion, ...]:
    """Suggestions, best first, with their rivals; the spectrum scatters `crowded` times as much as a steady one."""
    judged = _judged(list(found))
    disturbs = [s for s in judged if _takes_a_stretch(s.effect)]
    first = [s for s in disturbs if _disturbs(s, judged, fit)]
    # One that something else explains is no suggestion.
    judged = [s for s in judged if s not in disturbs or s in first]
    first += [s for s in judged if _stands_out(s, judged, fit)]
    ahead = [s for s in judged if _is_of_the_white(s.effect) and _by_far(s, judged)]
    ranked = sorted(judged, key=lambda s: _rank(s, crowded, s in first, s in ahead), reverse=True)
    return _with_rivals(_last_resort(_ties(_logged_first(ranked, fit)), fit))


def _stands_out(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """Whether it is outliers that nothing else in time explains, at the ends, in a few places or behind what is stationary.

    Or they have by far the most evidence. Of a settling that begins high above the noise the first samples stand out,
    of a loud stretch those within; beside it they do not. What is stationary has them anywhere: a tap would be called a
    resonance, lost samples a fast lag.
    """
    effect = out.effect
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is not None:
        return False
    taken = effect.missing(fit.data.n, fit.data.rate)
    ends = only_at_the_ends(effect, fit.data)
    if _by_far(out, found):
        return True
    if not (ends or _in_few_places(taken) or _made_by(out, found)):
        return False

    def power(one: Fit) -> float:
        if ends:
            return float(np.sum(at_the_ends(one.solution, one.data) ** 2))
        return float(np.sum(whiten(one.solution, one.data).samples[taken] ** 2))

    def explains(one: Effect) -> bool:
        return isinstance(one, Deterministic) and one.may_be(effect) if ends else _in_time(one)

    least = MAX_EXPLAINED_REMAINDER * power(fit)
    return not any(
        power(one.found) < least
        for one in found
        if one.significant and one is not out and explains(one.effect)
    )


def _by_far(one: Suggestion, found: list[Suggestion]) -> bool:
    """Whether it has far more evidence than anything else, other forms of a change of the noise level left aside.

    Not beside what jumps and comes back, or shakes for a while.
    """
    others = [s for s in found if s.significant and s is not one]
    if any(s.effect.screened == "two levels" or _takes_a_stretch(s.effect) for s in others):
        return False
    if _is_passing(one.effect):
        others = [s for s in others if not _is_passing(s.effect)]
    return one.score > MIN_SCORE_RATIO_AHEAD * max((s.score for s in others), default=0.0)


def _made_by(out: Suggestion, found: list[Suggestion]) -> bool:
    """Whether the best of what is stationary is none in the record without these samples."""
    stationary = [s for s in found if s.significant and not _in_time(s.effect)]
    if not stationary:
        return False
    best = max(stationary, key=lambda s: s.score)
    without = out.found.solution
    both = solve(out.found.data, without.model + best.effect, like=without)
    return (
        both.log_likelihood - without.log_likelihood
        < MAX_EXPLAINED_REMAINDER * best.delta_log_likelihood
    )


def _in_few_places(taken: NDArray[np.bool_]) -> bool:
    """Whether several samples taken out are next to each of them."""
    at = np.flatnonzero(taken)
    places = 1 + np.count_nonzero(np.diff(at) > taken.size // OUTLIER_CLUSTER_DIVISOR)
    return bool(at.size >= MIN_OUTLIERS_PER_CLUSTER * places)


def _disturbs(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """Whether the stretch that it takes out differs from the rest as much beside whatever else happens in time.

    What is louder by one factor leaves a shaken sensor quieter where the shaking was not.
    """
    effect, data = out.effect, fit.data
    if not out.significant or effect.when is None:
        return False
    if out.note:
        return True  # what is no measurement at all, whatever else there is
    first, last = ((t - data.start) / data.duration for t in effect.when)

    def left(one: Fit) -> float:
        return differs_by(whiten(one.solution, one.data), first, last)

    # What is stationary, whatever its spectrum, is as loud at all times. A few nats are chance.
    enough = max(MAX_EXPLAINED_REMAINDER * left(fit), MIN_DISTURBANCE_DELTA_LOGL)
    return not any(
        left(one.found) < enough
        for one in found
        if one.significant and one is not out and _in_time(one.effect)
    )


def _takes_a_stretch(effect: Effect) -> bool:
    return isinstance(effect, Modifier) and effect.removes and effect.when is not None


def _is_passing(effect: Effect) -> bool:
    return isinstance(effect, Modifier) and effect.passing


def _is_of_the_white(effect: Effect) -> bool:
    """Whether it changes the level of the white noise; a band that is louder for a while is named after the band."""
    return isinstance(effect, Modifier) and effect.passing and effect.band is None


def _in_time(effect: Effect) -> bool:
    taken = isinstance(effect, Modifier) and effect.removes
    return taken or _is_passing(effect) or isinstance(effect, Deterministic)


def _judged(found: list[Suggestion]) -> list[Suggestion]:
    """With a refined form that the record cannot tell from the plain one of its column as significant as that."""

    def judged(one: Suggestion) -> Suggestion:
        plain = [
            s.log10_p
            for s in found
            if _slow(s.effect, refined=False)
            and s.effect.follows == one.effect.follows
            and one.score - s.score < RIVAL
        ]
        if not _slow(one.effect, refined=True) or not plain or one.log10_p >= min(plain):
            return one
        least = min(plain)
        return replace(
            one, log10_p=least, significant=bool(least < np.log10(FALSE_ALARM_PROBABILITY))
        )

    return [judged(one) for one in found]


def _rank(found: Suggestion, crowded: float, first: bool, ahead: bool) -> tuple[bool, int, float]:
    """Significant ones first; what takes samples out explains none of them and comes after what does.

    So does a change of the noise level: the spectrum and the Allan curve stay as they are. But one so strong that the
    spectrum scatters by it comes first: nothing else can be judged before; and one that is far `ahead` goes by its
    evidence. So do the samples with which a record begins or ends: they stand out of those beside them, whatever the
    model, and would be called a step or a filter; and a disturbance, which would be called a resonance.
    """
    effect = found.effect
    if first:
        return found.significant, 3, found.score
    if _is_passing(effect) and crowded > MIN_OVERDISPERSION_LEVEL_FIRST:
        return found.significant, 2, found.score
    elsewhere = _in_time(effect) and isinstance(effect, Modifier) and not ahead
    return found.significant, int(not elsewhere), found.score


def _logged_first(ranked: list[Suggestion], fit: Fit) -> list[Suggestion]:
    """Where a function of time comes first and one of a logged column explains the record as well, the latter goes first.

    The column was measured; the function of time is a guess. "As well" is a tie in evidence, or a difference of the two
    functions below what the rounding of the column makes of it.
    """
    if not ranked or not _slow(ranked[0].effect) or ranked[0].effect.follows is not None:
        return ranked
    top = ranked[0]
    for other in ranked[1:]:
        if other.effect.follows is None or not _slow(other.effect, refined=False):
            continue
        tie = other.significant == top.significant and top.score - other.score < RIVAL
        if tie or _within_rounding(top.effect, other.effect, fit):
            # It was judged by what it adds to the function that it equals.
            as_sure = replace(other, log10_p=top.log10_p, significant=top.significant)
            first = other if tie else as_sure
            return [first, *(s for s in ranked if s is not other)]
    return ranked


def _within_rounding(first: Effect, follower: Effect, fit: Fit) -> bool:
    """Whether an effect differs from one of a coarse column by less than the rounding of that column adds to it."""
    assert isinstance(first, Deterministic)
    assert isinstance(follower, Deterministic)
    data, name = fit.data, follower.follows or ""
    logged = getattr(fit.recording, "covariates", {}).get(name)
    if logged is None or len(logged) != data.time.size or not np.isfinite(logged).all():
        return False
    curve = data.signal([follower])
    rounding = follower.signal(data.time, {**data.covariates, name: logged}) - curve
    return bool(np.std(data.signal([first]) - curve) < np.std(rounding))


def _ties(ranked: list[Suggestion]) -> list[Suggestion]:
    """Where a standard coefficient explains the record as well as the winner, it goes first.

    So does the form with the fewest numbers, then the first of the catalogue, among those that follow the same column,
    and any other slow function before a refined form: at a tie the record does not ask for it. And what does not work
    against an effect of the same column.
    """
    if not ranked or ranked[0].effect.standard:
        return ranked
    top = ranked[0]
    kinds = list(CATALOGUE)
    against = _against(top)

    def order(effect: Effect) -> tuple[int, int]:
        return effect.numbers, kinds.index(type(effect))

    for other in ranked[1:]:
        alike = other.effect.follows is not None and other.effect.follows == top.effect.follows
        plain = other.effect.standard or (alike and order(other.effect) < order(top.effect))
        plain = plain or (against and not _against(other))
        plain = plain or (_slow(top.effect, refined=True) and _slow(other.effect, refined=False))
        if plain and other.significant == top.significant and top.score - other.score < RIVAL:
            return [other, *(s for s in ranked if s is not other)]
    return ranked


def _slow(effect: Effect, refined: bool | None = None) -> bool:
    """Whether it is a slow function of time or of a column; with `refined`, of a form that has a plainer one or not."""
    return (
        isinstance(effect, Deterministic)
        and effect.screened == "slow"
        and refined in (None, effect.refined)
    )


def _against(found: Suggestion) -> bool:
    """Whether it takes back a part of what another effect of the model lets the same column do."""
    column = found.effect.follows
    sizes = [e.amplitudes()[0] for e in found.found.model.deterministic if e.follows == column]
    # What makes the noise louder with a column adds nothing to the samples.
    return column is not None and bool(sizes) and min(sizes) * max(sizes) < 0.0


def _last_resort(ranked: list[Suggestion], fit: Fit) -> list[Suggestion]:
    """A power law goes behind two standard coefficients that together explain as much.

    Flicker and random walk missing at once look like one exponent between them.
    """
    if not ranked or not ranked[0].effect.last_resort:
        return ranked
    top, present = ranked[0], {e.kind for e in fit.model}
    alone = [
        s
        for s in ranked[1:]
        if s.effect.standard and s.kind not in present and isinstance(s.effect, Stochastic)
    ]
    best: tuple[float, list[Suggestion]] = (top.score - RIVAL, [])
    for pair in combinations(alone, 2):
        both = solve(fit.data, Model((*fit.model.effects, *(type(s.effect)() for s in pair))))
        gain = both.log_likelihood - fit.solution.log_likelihood
        rank = gain - sum(cost(own, both) for own in both.effects[-2:])
        if rank > best[0] and (both.theta[-2:] > 0.0).all():
            best = (rank, [s for s in pair if s.significant])
    return [*best[1], *(s for s in ranked if s not in best[1])]


def _with_rivals(ranked: list[Suggestion]) -> tuple[Suggestion, ...]:
    out = []
    for one in ranked:
        rivals = tuple(
            dict.fromkeys(
                other.kind
                for other in ranked
                if other is not one
                and other.kind != one.kind
                and abs(other.score - one.score) < RIVAL
                and one.effect.may_be(other.effect)
            )
        )
        out.append(replace(one, rivals=rivals))
    return tuple(out)

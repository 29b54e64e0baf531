"""Ranking of suggestions by score; at a tie a logged column, a plain form or a standard coefficient goes first."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Deterministic, Model, Modifier, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, parameters_cost
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAX_EXPLAINED_REMAINDER,
    MIN_DISTURBANCE_DELTA_LOGL,
    MIN_OUTLIERS_PER_CLUSTER,
    MIN_OVERDISPERSION_LEVEL_FIRST,
    MIN_SCORE_RATIO_AHEAD,
    OUTLIER_CLUSTER_DIVISOR,
)
from allanite.suggestion.screens.exclusions import (
    at_the_ends,
    delta_logl_of_separate_levels,
    only_at_the_ends,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion

__all__ = ["in_order"]


def in_order(
    found: Iterable[Suggestion], fit: Fit, overdispersion: float
) -> tuple[Suggestion, ...]:
    """Suggestions ranked best first, each with its alternative explanations.

    `overdispersion` is the overdispersion of the spectrum from a missing change of the noise level (1 for a steady record).
    """
    judged = _with_plain_p_values(list(found))
    disturbances = [s for s in judged if _excludes_segment(s.effect)]
    first = [s for s in disturbances if _disturbance_leads(s, judged, fit)]
    # A disturbance that something else explains is not suggested.
    judged = [s for s in judged if s not in disturbances or s in first]
    first += [s for s in judged if _outliers_lead(s, judged, fit)]
    ahead = [s for s in judged if _changes_white_level(s.effect) and _is_far_ahead(s, judged)]
    ranked = sorted(
        judged, key=lambda s: _sort_key(s, overdispersion, s in first, s in ahead), reverse=True
    )
    return _with_rivals(_power_law_last(_plainest_first(_logged_columns_first(ranked, fit)), fit))


def _outliers_lead(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """True if the suggestion is outliers that go before all others.

    Outliers go first if their score is far above all others. They also go first if they lie at the ends of the record, lie
    in a few clusters, or alone cause the best process or filter; but not if something else in time explains them. A
    settling that begins high above the noise, or a loud segment, makes the first samples stand out; a tap looks like a
    resonance and lost samples look like a fast lag.
    """
    effect = out.effect
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is not None:
        return False
    taken = effect.missing(fit.data.n, fit.data.rate)
    ends = only_at_the_ends(effect, fit.data)
    if _is_far_ahead(out, found):
        return True
    if not (ends or _is_clustered(taken) or _causes_best_process(out, found)):
        return False

    def power(one: Fit) -> float:
        """Power of the outliers by the model of a fit: at the ends in raw samples, elsewhere in whitened ones."""
        if ends:
            return float(np.sum(at_the_ends(one.solution, one.data) ** 2))
        return float(np.sum(whiten(one.solution, one.data).samples[taken] ** 2))

    def explains(one: Effect) -> bool:
        """True if an effect could explain the outliers: at the ends only a transient that may look like them."""
        return isinstance(one, Deterministic) and one.may_be(effect) if ends else _acts_in_time(one)

    least = MAX_EXPLAINED_REMAINDER * power(fit)
    return not any(
        power(one.found) < least
        for one in found
        if one.significant and one is not out and explains(one.effect)
    )


def _is_far_ahead(one: Suggestion, found: list[Suggestion]) -> bool:
    """True if the score is more than `MIN_SCORE_RATIO_AHEAD` times that of any other significant suggestion.

    For a change of the noise level, other changes of the level do not count. Never true beside burst noise or a
    disturbance.
    """
    others = [s for s in found if s.significant and s is not one]
    if any(s.effect.screened == "two levels" or _excludes_segment(s.effect) for s in others):
        return False
    if _changes_level(one.effect):
        others = [s for s in others if not _changes_level(s.effect)]
    return one.score > MIN_SCORE_RATIO_AHEAD * max((s.score for s in others), default=0.0)


def _causes_best_process(out: Suggestion, found: list[Suggestion]) -> bool:
    """True if the best process or filter loses its evidence once these outliers are excluded."""
    stationary = [s for s in found if s.significant and not _acts_in_time(s.effect)]
    if not stationary:
        return False
    best = max(stationary, key=lambda s: s.score)
    without = out.found.solution
    both = solve(out.found.data, without.model + best.effect, like=without)
    return (
        both.log_likelihood - without.log_likelihood
        < MAX_EXPLAINED_REMAINDER * best.delta_log_likelihood
    )


def _is_clustered(taken: NDArray[np.bool_]) -> bool:
    """True if the excluded samples lie in clusters of at least `MIN_OUTLIERS_PER_CLUSTER` on average."""
    at = np.flatnonzero(taken)
    places = 1 + np.count_nonzero(np.diff(at) > taken.size // OUTLIER_CLUSTER_DIVISOR)
    return bool(at.size >= MIN_OUTLIERS_PER_CLUSTER * places)


def _disturbance_leads(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """True if the disturbance goes before all others: no other significant event in time explains its segment.

    A change of level by one factor explains a segment unless octaves still differ there beside it.
    """
    effect, data = out.effect, fit.data
    if not out.significant or effect.when is None:
        return False
    if out.note:
        return True  # a stuck value is no measurement, whatever else is missing
    first, last = ((t - data.start) / data.duration for t in effect.when)

    def left(one: Fit) -> float:
        """ΔlogL by separate levels of each octave in the segment, beside the model of a suggestion."""
        return delta_logl_of_separate_levels(whiten(one.solution, one.data), first, last)

    # Stationary noise of any spectrum is equally loud at all times, up to a few nats by chance.
    enough = max(MAX_EXPLAINED_REMAINDER * left(fit), MIN_DISTURBANCE_DELTA_LOGL)
    return not any(
        left(one.found) < enough
        for one in found
        if one.significant and one is not out and _acts_in_time(one.effect)
    )


def _excludes_segment(effect: Effect) -> bool:
    """True if the effect excludes one segment."""
    return isinstance(effect, Modifier) and effect.removes and effect.when is not None


def _changes_level(effect: Effect) -> bool:
    """True if the effect changes the noise level over time."""
    return isinstance(effect, Modifier) and effect.passing


def _changes_white_level(effect: Effect) -> bool:
    """True if the effect changes the level of the white noise, not of one band."""
    return isinstance(effect, Modifier) and effect.passing and effect.band is None


def _acts_in_time(effect: Effect) -> bool:
    """True if the effect acts at certain times: an exclusion, a change of level, or a function of time."""
    taken = isinstance(effect, Modifier) and effect.removes
    return taken or _changes_level(effect) or isinstance(effect, Deterministic)


def _with_plain_p_values(found: list[Suggestion]) -> list[Suggestion]:
    """Suggestions in which a refined form has the p-value of the plain form of its column, unless it is clearly better."""

    def judged(one: Suggestion) -> Suggestion:
        """The suggestion with the larger of the two p-values."""
        plain = [
            s.log10_p
            for s in found
            if _is_slow(s.effect, refined=False)
            and s.effect.follows == one.effect.follows
            and one.score - s.score < MAX_RIVAL_LOG_EVIDENCE
        ]
        if not _is_slow(one.effect, refined=True) or not plain or one.log10_p >= min(plain):
            return one
        least = min(plain)
        return replace(
            one, log10_p=least, significant=bool(least < np.log10(FALSE_ALARM_PROBABILITY))
        )

    return [judged(one) for one in found]


def _sort_key(
    found: Suggestion, overdispersion: float, first: bool, ahead: bool
) -> tuple[bool, int, float]:
    """Sort key of a suggestion: significance, class, score.

    Effects that explain the spectrum go before exclusions and changes of level, which leave the spectrum as it is. Outliers
    and disturbances in `first` lead. A change of level that makes the spectrum overdispersed leads too, because nothing
    else can be judged before. A suggestion far `ahead` competes by its score alone.
    """
    effect = found.effect
    if first:
        return found.significant, 3, found.score
    if _changes_level(effect) and overdispersion > MIN_OVERDISPERSION_LEVEL_FIRST:
        return found.significant, 2, found.score
    elsewhere = _acts_in_time(effect) and isinstance(effect, Modifier) and not ahead
    return found.significant, int(not elsewhere), found.score


def _logged_columns_first(ranked: list[Suggestion], fit: Fit) -> list[Suggestion]:
    """Suggestions in which a logged column goes before a function of time that explains the record no better.

    The column was measured; the function of time is a guess. The two tie if their scores are within
    `MAX_RIVAL_LOG_EVIDENCE`, or if the two functions differ by less than the rounding of the column.
    """
    if not ranked or not _is_slow(ranked[0].effect) or ranked[0].effect.follows is not None:
        return ranked
    top = ranked[0]
    for other in ranked[1:]:
        if other.effect.follows is None or not _is_slow(other.effect, refined=False):
            continue
        tie = (
            other.significant == top.significant
            and top.score - other.score < MAX_RIVAL_LOG_EVIDENCE
        )
        if tie or _within_rounding(top.effect, other.effect, fit):
            # Its own p-value is that of what it adds beside an equal function of time.
            as_sure = replace(other, log10_p=top.log10_p, significant=top.significant)
            first = other if tie else as_sure
            return [first, *(s for s in ranked if s is not other)]
    return ranked


def _within_rounding(first: Effect, follower: Effect, fit: Fit) -> bool:
    """True if a function differs from that of a coarse column by less than the rounding of the column changes it."""
    assert isinstance(first, Deterministic)
    assert isinstance(follower, Deterministic)
    data, name = fit.data, follower.follows or ""
    logged = getattr(fit.recording, "covariates", {}).get(name)
    if logged is None or len(logged) != data.time.size or not np.isfinite(logged).all():
        return False
    curve = data.signal([follower])
    rounding = follower.signal(data.time, {**data.covariates, name: logged}) - curve
    return bool(np.std(data.signal([first]) - curve) < np.std(rounding))


def _plainest_first(ranked: list[Suggestion]) -> list[Suggestion]:
    """Suggestions in which the plainest of those within `MAX_RIVAL_LOG_EVIDENCE` of the best goes first.

    Plainer than the best are: a standard coefficient; a form of the same column with fewer parameters, or earlier in the
    catalogue; any slow function beside a refined form; and an effect that does not cancel another effect of the same
    column.
    """
    if not ranked or ranked[0].effect.standard:
        return ranked
    top = ranked[0]
    kinds = list(CATALOGUE)
    against = _cancels_another(top)

    def order(effect: Effect) -> tuple[int, int]:
        """Number of parameters, then position in the catalogue."""
        return effect.numbers, kinds.index(type(effect))

    for other in ranked[1:]:
        alike = other.effect.follows is not None and other.effect.follows == top.effect.follows
        plain = other.effect.standard or (alike and order(other.effect) < order(top.effect))
        plain = plain or (against and not _cancels_another(other))
        plain = plain or (
            _is_slow(top.effect, refined=True) and _is_slow(other.effect, refined=False)
        )
        if (
            plain
            and other.significant == top.significant
            and top.score - other.score < MAX_RIVAL_LOG_EVIDENCE
        ):
            return [other, *(s for s in ranked if s is not other)]
    return ranked


def _is_slow(effect: Effect, refined: bool | None = None) -> bool:
    """True if the effect is a slow function of time or of a column; `refined` asks for a refined or a plain form."""
    return (
        isinstance(effect, Deterministic)
        and effect.screened == "slow"
        and refined in (None, effect.refined)
    )


def _cancels_another(found: Suggestion) -> bool:
    """True if the suggestion partly cancels another effect of the same column."""
    column = found.effect.follows
    sizes = [e.amplitudes()[0] for e in found.found.model.deterministic if e.follows == column]
    # A noise level that follows a column adds nothing to the samples.
    return column is not None and bool(sizes) and min(sizes) * max(sizes) < 0.0


def _power_law_last(ranked: list[Suggestion], fit: Fit) -> list[Suggestion]:
    """Suggestions in which a power law goes behind two standard coefficients that together explain as much.

    Missing flicker and random walk together look like one exponent between them.
    """
    if not ranked or not ranked[0].effect.last_resort:
        return ranked
    top, present = ranked[0], {e.kind for e in fit.model}
    alone = [
        s
        for s in ranked[1:]
        if s.effect.standard and s.kind not in present and isinstance(s.effect, Stochastic)
    ]
    best: tuple[float, list[Suggestion]] = (top.score - MAX_RIVAL_LOG_EVIDENCE, [])
    for pair in combinations(alone, 2):
        both = solve(fit.data, Model((*fit.model.effects, *(type(s.effect)() for s in pair))))
        gain = both.log_likelihood - fit.solution.log_likelihood
        rank = gain - sum(parameters_cost(own, both) for own in both.effects[-2:])
        if rank > best[0] and (both.theta[-2:] > 0.0).all():
            best = (rank, [s for s in pair if s.significant])
    return [*best[1], *(s for s in ranked if s not in best[1])]


def _with_rivals(ranked: list[Suggestion]) -> tuple[Suggestion, ...]:
    """Suggestions, each with the kinds that may be confused with it and have a score within `MAX_RIVAL_LOG_EVIDENCE`."""
    out = []
    for one in ranked:
        rivals = tuple(
            dict.fromkeys(
                other.kind
                for other in ranked
                if other is not one
                and other.kind != one.kind
                and abs(other.score - one.score) < MAX_RIVAL_LOG_EVIDENCE
                and one.effect.may_be(other.effect)
            )
        )
        out.append(replace(one, rivals=rivals))
    return tuple(out)

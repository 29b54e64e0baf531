"""Exclusions that go first: what must be decided before any other effect can be judged.

Outliers, disturbances and changes of the noise level act at certain times. They go first if nothing else that is missing
explains their samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Deterministic, Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import whiten
from allanite.suggestion.constants import (
    LEVEL_CELLS,
    MAX_EXPLAINED_REMAINDER,
    MIN_DISTURBANCE_DELTA_LOGL,
    MIN_OUTLIERS_PER_CLUSTER,
)
from allanite.suggestion.screens.exclusions import (
    delta_logl_of_separate_levels,
    end_outlier_scores,
    excludes_only_ends,
)

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion


def goes_first(one: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """True if the suggestion excludes samples (a disturbance or outliers) and must be added before all others in `found`.

    No other significant suggestion may explain these samples.
    """
    if excludes_segment(one.effect):
        return _disturbance_goes_first(one, found, fit)
    return _outliers_go_first(one, found, fit)


def _disturbance_goes_first(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """True if the suggestion `out` excludes a significant disturbance and must be added before all others in `found`.

    This holds if no other significant event in time explains its segment. Separate levels of the octaves in the segment
    raise logL. An event explains the segment if it lowers this rise below 14 nats or below 10 %, the larger limit.
    Always True for a significant stuck value; never for an insignificant disturbance or one without times.
    """
    effect, data = out.effect, fit.data
    if not out.significant or effect.when is None:
        return False
    if out.note:
        return True  # a stuck value is no measurement, whatever else is missing
    first, last = ((t - data.start) / data.duration for t in effect.when)

    def remaining_delta_logl(one: Fit) -> float:
        """ΔlogL of separate noise levels of each octave in the segment, for samples whitened by the model of `one`."""
        return delta_logl_of_separate_levels(whiten(one.solution, one.data), first, last)

    # Stationary noise of any spectrum is equally loud at all times, up to a few nats by chance.
    enough = max(MAX_EXPLAINED_REMAINDER * remaining_delta_logl(fit), MIN_DISTURBANCE_DELTA_LOGL)
    return not any(
        remaining_delta_logl(one.found) < enough
        for one in found
        if one.significant and one is not out and acts_in_time(one.effect)
    )


def _outliers_go_first(out: Suggestion, found: list[Suggestion], fit: Fit) -> bool:
    """True if the suggestion `out` excludes outliers and must be added before all others in `found`.

    Outliers go first if `is_far_ahead` holds. They also go first if they lie at the ends of the record, lie in a few
    clusters, or alone cause the best process or filter; but not if something else in time explains them. A settling
    that begins high above the noise, or a loud segment, makes the first samples stand out. A tap looks like a
    resonance, and lost samples look like a fast Gauss–Markov process.
    """
    effect = out.effect
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is not None:
        return False
    taken = effect.missing(fit.data.n, fit.data.rate)
    ends = excludes_only_ends(effect, fit.data)
    if is_far_ahead(out, found):
        return True
    if not (ends or _is_clustered(taken) or _causes_best_process(out, found)):
        return False

    def power(one: Fit) -> float:
        """Sum of squares of the outliers under the model of a fit: of scores at the ends, of whitened samples elsewhere."""
        if ends:
            return float(np.sum(end_outlier_scores(one.solution, one.data) ** 2))
        return float(np.sum(whiten(one.solution, one.data).samples[taken] ** 2))

    def explains(one: Effect) -> bool:
        """True if the effect could explain the outliers: any effect in time, but at the ends only a transient."""
        return isinstance(one, Deterministic) and one.may_be(effect) if ends else acts_in_time(one)

    least = MAX_EXPLAINED_REMAINDER * power(fit)
    return not any(
        power(one.found) < least
        for one in found
        if one.significant and one is not out and explains(one.effect)
    )


def _is_clustered(taken: NDArray[np.bool_]) -> bool:
    """True if the samples in the mask `taken` lie in clusters of at least 4 on average.

    Samples at most 1/256 of the record apart are in one cluster.
    """
    at = np.flatnonzero(taken)
    places = 1 + np.count_nonzero(np.diff(at) > taken.size // LEVEL_CELLS)
    return bool(at.size >= MIN_OUTLIERS_PER_CLUSTER * places)


def _causes_best_process(out: Suggestion, found: list[Suggestion]) -> bool:
    """True if the best significant process or filter loses 90 % of its ΔlogL once these outliers are excluded.

    The best one has the highest score. False without a significant process or filter.
    """
    stationary = [s for s in found if s.significant and not acts_in_time(s.effect)]
    if not stationary:
        return False
    best = max(stationary, key=lambda s: s.score)
    without = out.found.solution
    both = solve(out.found.data, without.model + best.effect, like=without)
    return (
        both.log_likelihood - without.log_likelihood
        < MAX_EXPLAINED_REMAINDER * best.delta_log_likelihood
    )


def is_far_ahead(one: Suggestion, found: list[Suggestion]) -> bool:
    """True if no other significant suggestion has a score above a tenth of the score of `one`.

    For a change of the noise level, other changes of the level do not count. False if burst noise or a disturbance is
    significant.
    """
    others = [s for s in found if s.significant and s is not one]
    if any(s.effect.screened == "two levels" or excludes_segment(s.effect) for s in others):
        return False
    if changes_level(one.effect):
        others = [s for s in others if not changes_level(s.effect)]
    return MAX_EXPLAINED_REMAINDER * one.score > max((s.score for s in others), default=0.0)


def excludes_segment(effect: Effect) -> bool:
    """True if the effect excludes one segment of samples (not single outliers)."""
    return isinstance(effect, Modifier) and effect.removes and effect.when is not None


def changes_level(effect: Effect) -> bool:
    """True if the effect changes a noise level over time."""
    return isinstance(effect, Modifier) and effect.passing


def excludes_or_changes_level(effect: Effect) -> bool:
    """True if the effect excludes samples or changes a noise level over time, and so leaves the mean spectrum as it is."""
    return isinstance(effect, Modifier) and (effect.removes or effect.passing)


def acts_in_time(effect: Effect) -> bool:
    """True if the effect acts at certain times: an exclusion, a change of noise level, or a function of time."""
    taken = isinstance(effect, Modifier) and effect.removes
    return taken or changes_level(effect) or isinstance(effect, Deterministic)

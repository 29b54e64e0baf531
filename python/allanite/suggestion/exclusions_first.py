"""Exclusions that go first: what must be decided before any other effect can be judged.

Outliers, disturbances and changes of the noise level act at certain times. They go first if nothing else that is missing
explains their samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.whitened import Whitened, expected_level
from allanite.suggestion.constants import (
    LEVEL_CELLS,
    MAIN_SHARE,
    MAX_EXPLAINED_REMAINDER,
    MIN_DISTURBANCE_DELTA_LOGL,
    MIN_OUTLIERS_PER_CLUSTER,
)
from allanite.suggestion.screens.exclusions import (
    delta_logl_of_octave_levels,
    end_outlier_scores,
    excludes_only_ends,
    octaves_of,
)
from allanite.suggestion.screens.level_changes import level_series

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion


def disturbance_goes_first(
    out: Suggestion, found: list[Suggestion], fit: Fit, whitened_by: Callable[[Fit], Whitened]
) -> bool:
    """True if the suggestion `out` excludes a segment and must be added before all other suggestions in `found`.

    This holds for a stuck value, and for a loud segment that no other significant suggestion with an effect at certain
    times explains. Such an effect explains the segment if, with it, the ΔlogL of separate noise levels in the segment falls
    below 14 nats or 10 % of its value (50 % for scattered outliers). False as well if the best process is a narrow band
    that does not come from the segment. The band may move, and frequencies that it seldom visits are loud for a short time
    without a disturbance.
    """
    effect, data = out.effect, fit.data
    if not out.significant or effect.when is None:
        return False
    if out.note:
        return True  # a stuck value is no measurement, whatever else is missing
    best = _best_process(found)
    is_band = best is not None and isinstance(best.effect, Stochastic) and best.effect.occupies
    if is_band and not _causes(out, best):
        return False
    first, last = ((t - data.start) / data.duration for t in effect.when)

    def remaining_delta_logl(one: Fit) -> float:
        """ΔlogL, nats, of another noise level in each octave of the segment, whitened by the model of the fit `one`."""
        return delta_logl_of_octave_levels(
            octaves_of(whitened_by(one).with_normal_tails), first, last
        )

    risen = remaining_delta_logl(fit)

    def explains(one: Suggestion) -> bool:
        """True if little difference of noise level remains in the segment with the model of the suggestion `one`."""
        share = MAIN_SHARE if _is_scattered(one.effect, data) else MAX_EXPLAINED_REMAINDER
        # Stationary noise of any spectrum is equally loud at all times, up to a few nats by chance.
        return remaining_delta_logl(one.found) < max(share * risen, MIN_DISTURBANCE_DELTA_LOGL)

    others = (s for s in found if s.significant and s is not out and acts_in_time(s.effect))
    return not any(map(explains, others))


def _is_scattered(effect: Effect, data: Data) -> bool:
    """True if the effect excludes outliers with fewer than 4 samples per cluster: jumps and spikes, not shaking."""
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is not None:
        return False
    return not _is_clustered(effect.missing(data.n, data.rate))


def outliers_go_first(
    out: Suggestion, found: list[Suggestion], fit: Fit, whitened_by: Callable[[Fit], Whitened]
) -> bool:
    """True if the suggestion `out` excludes outliers and must be added before all other suggestions in `found`.

    Outliers go first if their score is far above that of every other significant suggestion (`is_far_ahead`). Otherwise two
    conditions must hold:

    * The outliers lie only at the ends of the record, or in a few clusters, or cause the best process or filter, or the
      best effect that is no exclusion or change of level: a step of a clock's phase looks like a slow hump.
    * No other significant suggestion with an effect at certain times removes more than 90 % of the outliers' power.
    """
    # A settling that begins high above the noise, or a loud segment, makes the first samples stand out. A tap looks like
    # a resonance, and lost samples look like a fast Gauss–Markov process.
    effect = out.effect
    if not isinstance(effect, Modifier) or not effect.removes:
        return False
    taken = effect.missing(fit.data.n, fit.data.rate)
    ends = excludes_only_ends(effect, fit.data)
    if is_far_ahead(out, found):
        return True
    others = [s for s in found if s.significant and not excludes_or_changes_level(s.effect)]
    causes = _causes(out, _best(others)) or _causes(out, _best_process(found))
    if not (ends or _is_clustered(taken) or causes):
        return False

    def power(one: Fit) -> float:
        """Sum of squares of the outliers after whitening by the model of the fit `one`.

        If all outliers lie at the ends of the record, which are not whitened, that of their `end_outlier_scores`.
        """
        if ends:
            return float(np.sum(end_outlier_scores(one.solution, one.data) ** 2))
        return float(np.sum(whitened_by(one).samples[taken] ** 2))

    def explains(one: Effect) -> bool:
        """True if the effect could explain the outliers: an effect that acts at certain times.

        For outliers at the ends of the record, only a function of time that can be confused with them (`may_be`).
        """
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


def _causes(out: Suggestion, best: Suggestion | None) -> bool:
    """True if the samples that `out` excludes cause the suggestion `best`; False without one.

    They cause it if its ΔlogL falls by more than 90 % once they are excluded, with its shapes as fitted.
    """
    if best is None:
        return False
    without = out.found.solution
    both = solve(out.found.data, without.model + best.effect, like=without, polish=False)
    return (
        both.log_likelihood - without.log_likelihood
        < MAX_EXPLAINED_REMAINDER * best.delta_log_likelihood
    )


def _best_process(found: list[Suggestion]) -> Suggestion | None:
    """Significant process or filter with the highest score; None without one."""
    return _best([s for s in found if s.significant and not acts_in_time(s.effect)])


def _best(found: list[Suggestion]) -> Suggestion | None:
    """Suggestion with the highest score; None without one."""
    return max(found, key=lambda s: s.score, default=None)


def explained_by_process(
    level: Suggestion, found: list[Suggestion], fit: Fit, whitened_by: Callable[[Fit], Whitened]
) -> bool:
    """True if the best significant process or filter in `found` explains a change of level: its ΔlogL falls by over half.

    A missing band may make up most of the whitened power, so that a change of the band looks like a change of all noise.
    False if `level` changes only one band.
    """
    best, effect = _best_process(found), level.effect
    if best is None or not isinstance(effect, Modifier) or effect.band is not None:
        return False

    def delta_logl(one: Fit) -> float:
        """ΔlogL of the change of level in the power over time of a record whitened by the model of `one`."""
        series = level_series(one.solution, one.data, whitened_by(one))
        if series is None:
            return 0.0
        return series.delta_logl(expected_level(Model((effect,)), one.data, series.power.size))

    return delta_logl(best.found) < MAIN_SHARE * delta_logl(fit)


def is_far_ahead(one: Suggestion, found: list[Suggestion]) -> bool:
    """True if every other significant suggestion has a score below a tenth of the score of `one`.

    False if another significant suggestion is burst noise or a disturbance.
    """
    others = [s for s in found if s.significant and s is not one]
    if any(s.effect.screened == "two levels" or excludes_segment(s.effect) for s in others):
        return False
    if one.effect.changes_level:
        others = [s for s in others if not s.effect.changes_level]
    return MAX_EXPLAINED_REMAINDER * one.score > max((s.score for s in others), default=0.0)


def excludes_segment(effect: Effect) -> bool:
    """True if the effect excludes one segment of samples (not single outliers)."""
    return effect.removes and effect.when is not None


def excludes_or_changes_level(effect: Effect) -> bool:
    """True if the effect excludes samples or changes a noise level over time."""
    return effect.removes or effect.changes_level


def acts_in_time(effect: Effect) -> bool:
    """True if the effect acts at certain times: an exclusion, a change of noise level, or a function of time."""
    return excludes_or_changes_level(effect) or isinstance(effect, Deterministic)

"""Ranking of suggestions by their score, `Suggestion.score`: the log evidence plus `prior` (`allanite.fit.rivals.score`).

By the prior, a measured cause wins a tie: a logged column was measured, and a function of time with the same shape is a
guess. Standard coefficients are in every data sheet; a power law or a refined form names no cause.

Effects that lower the model discrepancy go before the others. Exclusions and changes of the noise level leave the
spectrum as it is. They go behind what explains the spectrum, unless `allanite.suggestion.exclusions_first` decides that
they go first.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from allanite.effects import Effect, Modifier
from allanite.fit.likelihood.whitened import Whitened, whiten
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.suggestion.constants import MIN_OVERDISPERSION_LEVEL_FIRST, MIN_SCORE_GAIN
from allanite.suggestion.exclusions_first import (
    disturbance_goes_first,
    excludes_or_changes_level,
    excludes_segment,
    explained_by_process,
    is_far_ahead,
    outliers_go_first,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion


def min_score(effect: Effect) -> float:
    """Score above which a suggestion may be significant: 0.5 nats; −∞ for exclusions and changes of the noise level."""
    # The cost of exclusions and changes of level, that of BIC, counts all ordinates and is too high.
    return -math.inf if excludes_or_changes_level(effect) else MIN_SCORE_GAIN


def in_order(
    found: Iterable[Suggestion], fit: Fit, whitened: Whitened, overdispersion: float
) -> tuple[Suggestion, ...]:
    """Tuple of copies of the suggestions, best first, with the kinds of alternative explanations filled in as `rivals`.

    Significant ones come first. Among them the order is:

    * excluded segments, then outliers, if nothing else explains them (`disturbance_goes_first`, `outliers_go_first`);
      other excluded segments are omitted,
    * changes of the noise level that no process explains, if `overdispersion` is above 1.1,
    * all other effects, and a change of the level of all frequencies that is far ahead,
    * other exclusions and changes of level.

    Within each group, effects that lower the model discrepancy come first: as long as the whole spectrum is wrong, the
    scores of events and lines are wrong, too. Then the highest score comes first. `whitened` is the whitened record of
    `fit`, and `overdispersion` that of the spectrum, 1 for a steady record.
    """
    judged = list(found)

    @lru_cache(maxsize=1)
    def whitened_by(one: Fit) -> Whitened:
        """Whitened record of the fit of a suggestion, or of `fit`."""
        return whitened if one is fit else whiten(one.solution, one.data)

    # A disturbance that something else explains is not suggested, and delays no outliers.
    judged = [
        s
        for s in judged
        if not excludes_segment(s.effect) or disturbance_goes_first(s, judged, fit, whitened_by)
    ]
    first = [
        s
        for s in judged
        if excludes_segment(s.effect) or outliers_go_first(s, judged, fit, whitened_by)
    ]

    def is_alone(one: Suggestion) -> bool:
        """True if the suggestion is a significant change of level that no process explains."""
        return (
            one.significant
            and one.effect.changes_level
            and not explained_by_process(one, judged, fit, whitened_by)
        )

    def key(one: Suggestion) -> tuple[bool, int, bool, float]:
        """Sort key (significant, class, lowers the discrepancy, score) of a suggestion; the highest key comes first.

        The classes are 4 for a segment to exclude, 3 for outliers that go first, 2, 1 and 0 for the other groups of
        `in_order`.
        """
        if one in first:
            place = 3 + excludes_segment(one.effect)
        elif overdispersion > MIN_OVERDISPERSION_LEVEL_FIRST and is_alone(one):
            place = 2
        else:
            white = isinstance(one.effect, Modifier) and one.effect.band is None
            waits = excludes_or_changes_level(one.effect)
            place = int(not waits or (white and is_far_ahead(one, judged) and is_alone(one)))
        lowers = one.significant and one.found.discrepancy.is_below(fit.discrepancy)
        return one.significant, place, lowers, one.score

    return _with_rivals(sorted(judged, key=key, reverse=True))


def _with_rivals(ranked: list[Suggestion]) -> tuple[Suggestion, ...]:
    """Tuple of copies of the suggestions, in the same order, with `rivals` filled in: kinds that explain the data as well.

    A rival is another suggested kind with a score less than 3 nats away, which a short record may confuse with the effect.
    """
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

"""Replace: another effect takes the place of one or two, or two take the place of one (a split)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Effect, Model, Modifier
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.replacements import replacements
from allanite.fit.rivals.score import is_broad
from allanite.suggestion.constants import MIN_SCORE_GAIN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.result import Fit


def models_with_replacement(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Iterator over (expected gain, indices, model): models in which other effects replace one or two detected effects.

    The gain is the expected rise of the score, nats. `indices` are those of the replaced effects in the old model. Two
    effects are replaced together only if both are slow processes. The new effects are the last of the new model. Effects
    of the initial model are replaced like all others.
    """
    for other in replacements(fit, may_take_the_place):
        # A lead above 3 nats always gives more than 0.5.
        prior = max(other.prior, MIN_SCORE_GAIN - MAX_RIVAL_LOG_EVIDENCE)
        yield other.lead + prior, other.places, other.solution.model


def may_take_the_place(effect: Effect, out: Effect) -> bool:
    """True if `effect` may replace `out` because of a higher score alone.

    False in three cases: `effect` is an event and `out` is not; `effect` is a filter, and `out` is neither a filter nor a
    broad hump; `effect` has no physical name.
    """
    # The evidence of an event is not corrected for the many times that were tried.
    event = effect.happens_once and not out.happens_once
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (event or filtering or effect.nameless)

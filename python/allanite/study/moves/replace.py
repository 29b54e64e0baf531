"""Replace: another effect takes the place of one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Modifier
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.together import is_broad
from allanite.suggestion.constants import MIN_SCORE_GAIN
from allanite.suggestion.ranking import prior

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit


def replacements(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Models with one effect, or two wandering processes, replaced: promised gain, indices of the removed effects, model.

    A declared alternative replaces one effect. The new effects are the last of the model. A model whose evidence leads by
    more than `MAX_RIVAL_LOG_EVIDENCE` promises a gain whatever the priors are.
    """
    effects = fit.model.effects
    for lead, places, solution in fit.instead_of_two:
        if all(is_detected(fit, place) for place in places):
            new = solution.model.effects[len(effects) - 2 :]
            priors = sum(map(prior, new)) - sum(prior(effects[place]) for place in places)
            yield _promised(lead, priors), places, solution.model
    for place, out in enumerate(fit.model.effects):
        if is_detected(fit, place):
            for other in fit.alternatives(place):
                if may_take_the_place(other.effect, out):
                    priors = prior(other.effect) - prior(out)
                    yield _promised(other.evidence, priors), (place,), other.solution.model


def _promised(lead: float, priors: float) -> float:
    """Gain of a model whose evidence leads by `lead`, nats; above `MIN_SCORE_GAIN` if the lead alone decides."""
    return lead + max(priors, MIN_SCORE_GAIN - MAX_RIVAL_LOG_EVIDENCE)


def may_take_the_place(effect: Effect, out: Effect) -> bool:
    """True if the score alone may put an effect here: an event only for an event, a filter for a filter or a broad hump."""
    event = _is_event(effect) and not _is_event(out)
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (event or filtering or effect.nameless)


def _is_event(effect: Effect) -> bool:
    """True for an effect that happens once: its evidence does not pay for the many times that were tried."""
    return isinstance(effect, Deterministic) and effect.happens_once

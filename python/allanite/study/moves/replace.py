"""Replace: another effect takes the place of one or two, or two take the place of one (a split)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Modifier
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.rivals.pairs import solution_with_pair
from allanite.fit.rivals.score import is_broad, prior_change, replacing_prior
from allanite.suggestion.constants import MIN_SCORE_GAIN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit


def models_with_replacement(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Iterator over (expected gain, indices, model): models in which an alternative replaces one or two detected effects.

    The gain is the expected rise of the score, nats. `indices` are those of the replaced effects in the old model. Two
    effects are replaced together only if both are slow processes. The new effects are the last of the new model.
    """
    for lead, places, solution in fit.alternatives_to_pairs:
        yield _expected_gain(fit, lead, solution.model), places, solution.model
    for place, out in enumerate(fit.model.effects):
        if is_detected(fit, place):
            for other in fit.alternatives(place):
                if may_take_the_place(other.effect, out):
                    model = other.solution.model
                    yield _expected_gain(fit, other.evidence, model), (place,), model


def _expected_gain(fit: Fit, lead: float, model: Model) -> float:
    """Expected rise of the score, nats, if another `model` replaces that of the fit: `lead` plus the prior's change.

    `lead` is its rise of log evidence. The change of the prior counts as at least −2.5, so that a `lead` above 3 nats
    always gives more than 0.5.
    """
    return lead + max(prior_change(fit.model, model), MIN_SCORE_GAIN - MAX_RIVAL_LOG_EVIDENCE)


def models_with_split(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Iterator over (expected gain, indices, model): models in which two effects replace a detected one.

    The gain is the rise of log evidence of the refit, plus the smaller prior of the two effects, minus the prior of the
    replaced effect, nats. The new effects are the last of the model.
    """
    for place, out in enumerate(fit.model.effects):
        if not is_detected(fit, place):
            continue
        for pair in fit.alternative_pairs(place):
            if all(may_take_the_place(effect, out) for effect in pair.model.effects[-2:]):
                rarer = min(replacing_prior(effect) for effect in pair.model.effects[-2:])
                # A lead above 3 nats always gives more than 0.5.
                price = min(replacing_prior(out) - rarer, MAX_RIVAL_LOG_EVIDENCE - MIN_SCORE_GAIN)
                found = solution_with_pair(fit, pair)
                lead = evidence_gain(found, fit.solution, fit.data)
                yield lead - price, (place,), found.model


def may_take_the_place(effect: Effect, out: Effect) -> bool:
    """True if `effect` may replace `out` because of a higher score alone.

    False in three cases: `effect` is an event and `out` is not; `effect` is a filter, and `out` is neither a filter nor a
    broad hump; `effect` has no physical name.
    """
    # The evidence of an event is not corrected for the many times that were tried.
    event = effect.happens_once and not out.happens_once
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (event or filtering or effect.nameless)

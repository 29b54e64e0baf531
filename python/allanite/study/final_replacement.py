"""Final replacement pass: an effect of the last model is replaced by one or two others if the score is higher."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Modifier
from allanite.fit import refitted
from allanite.fit.rivals.alternatives import is_detected, is_removable
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.rivals.together import is_broad, together
from allanite.study.error_comparison import no_error_rises
from allanite.study.ladder import Rung
from allanite.suggestion.constants import MIN_SCORE_GAIN

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit

__all__ = ["best_replacement"]


def best_replacement(ladder: Sequence[Rung]) -> Rung | None:
    """Step on which one or two effects replace one of the last model with the highest score; None if no score is higher.

    The score is the log evidence. Effects that only describe, and refined forms of a dependence, pay
    `MAX_RIVAL_LOG_EVIDENCE` in addition, so that they come only if plainer effects explain clearly less. No step raises an
    error beyond its scatter.
    """
    fit = ladder[-1].fit
    reachable = sorted(_reachable(fit), key=lambda found: -found[0])
    for promised, places, model in reachable:
        if promised <= MIN_SCORE_GAIN:
            break
        better = refitted(fit, model)
        came = model.effects[len(fit.model) - len(places) :]
        new = [i for i, e in enumerate(better.model) if e.kind in {each.kind for each in came}]
        more = (
            _prior_of_model(better)
            - _prior_of_model(fit)
            + evidence_gain(better.solution, fit.solution, fit.data)
        )
        if (
            more > MIN_SCORE_GAIN
            and all(is_detected(better, i) for i in new)
            and no_error_rises(fit, better)
        ):
            left = {fit.model.effects[place].kind for place in places}
            gone = tuple(left - {effect.kind for effect in came})
            came = tuple(e for e in came if e.kind not in left) or came
            risen = better.solution.log_likelihood - fit.solution.log_likelihood
            start = sum(rung.dropped_start for rung in ladder)
            start_kinds = [e.kind for e in fit.model.effects[: len(ladder[0].fit.model) - start]]
            dropped = sum(kind in start_kinds for kind in gone)
            return Rung(better, came[0], gone, risen, dropped, came[1:])
    return None


def _reachable(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Models with one or two effects replaced: score over that of the fit, places of the effects that leave, and model.

    The new effects are the last of the model.
    """
    for place, out in enumerate(fit.model.effects):
        if not is_detected(fit, place):
            continue
        kept = _prior(out)
        for other in fit.alternatives(place):
            if _may_replace(other.effect, out):
                yield other.evidence + _prior(other.effect) - kept, (place,), other.solution.model
        for pair in fit.together(place):
            if all(_may_replace(effect, out) for effect in pair.model.effects[-2:]):
                yield pair.evidence - kept, (place,), pair.model
        for beside in _filters_beside(fit, place):
            for pair in together(fit, place, also=beside):
                if fit.model.effects[beside].kind in pair.kinds:
                    yield pair.evidence - kept, (place, beside), pair.model


def _filters_beside(fit: Fit, place: int) -> Iterator[int]:
    """Places of filters that may have the wrong design because the broad hump at `place` makes up for it."""
    out = fit.model.effects[place]
    if is_broad(out):
        for other, effect in enumerate(fit.model.effects):
            if isinstance(effect, Modifier) and is_removable(effect) and effect.may_be(out):
                yield other


def _prior_of_model(fit: Fit) -> float:
    """Sum of the prior scores of the effects of a fit, nats."""
    return sum(_prior(effect) for effect in fit.model)


def _prior(effect: Effect) -> float:
    """Prior score of an effect, nats: −`MAX_RIVAL_LOG_EVIDENCE` for a power law or a refined form, else 0."""
    refined = isinstance(effect, Deterministic) and effect.refined
    return -MAX_RIVAL_LOG_EVIDENCE if effect.last_resort or refined else 0.0


def _may_replace(effect: Effect, out: Effect) -> bool:
    """True if the score alone may put an effect here: no one-off event; a filter only for a filter or a broad hump."""
    once = isinstance(effect, Deterministic) and effect.happens_once
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (once or filtering or effect.nameless)

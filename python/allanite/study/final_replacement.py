"""The end of a search: the last model gives way to the reachable one with the highest score."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Modifier
from allanite.fit import refitted
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.study.error_comparison import errors_fall
from allanite.study.ladder import Rung
from allanite.suggestion.constants import MIN_SCORE_GAIN

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit

__all__ = ["exchanged"]


def exchanged(ladder: Sequence[Rung]) -> Rung | None:
    """The rung on which another effect, or two, take the place of one of the last model; None where no score is higher.

    The score is ln of the evidence. What describes without explaining and the refined forms of a dependence pay
    `MAX_RIVAL_LOG_EVIDENCE` in addition, so that they come only where plainer effects explain clearly less. No step raises
    an error beyond its scatter.
    """
    fit = ladder[-1].fit
    reachable = sorted(_reachable(fit), key=lambda found: -found[0])
    for promised, place, model in reachable:
        if promised <= MIN_SCORE_GAIN:
            break
        better = refitted(fit, model)
        came = model.effects[len(fit.model) - 1 :]
        new = [i for i, e in enumerate(better.model) if e.kind in {each.kind for each in came}]
        more = (
            _priors(better) - _priors(fit) + evidence_gain(better.solution, fit.solution, fit.data)
        )
        if (
            more > MIN_SCORE_GAIN
            and all(is_detected(better, i) for i in new)
            and errors_fall(fit, better)
        ):
            kind = fit.model.effects[place].kind
            risen = better.solution.log_likelihood - fit.solution.log_likelihood
            start = sum(rung.dropped_start for rung in ladder)
            asked = [e.kind for e in fit.model.effects[: len(ladder[0].fit.model) - start]]
            return Rung(better, came[0], (kind,), risen, int(kind in asked), came[1:])
    return None


def _reachable(fit: Fit) -> Iterator[tuple[float, int, Model]]:
    """The score over that of the fit, the place of the effect that leaves, and the model; what comes stands last."""
    for place, out in enumerate(fit.model.effects):
        if not is_detected(fit, place):
            continue
        kept = _prior(out)
        for other in fit.alternatives(place):
            if _may_come(other.effect, out):
                yield other.evidence + _prior(other.effect) - kept, place, other.solution.model
        for pair in fit.together(place):
            if all(_may_come(effect, out) for effect in pair.model.effects[-2:]):
                yield pair.evidence - kept, place, pair.model


def _priors(fit: Fit) -> float:
    return sum(_prior(effect) for effect in fit.model)


def _prior(effect: Effect) -> float:
    refined = isinstance(effect, Deterministic) and effect.refined
    return -MAX_RIVAL_LOG_EVIDENCE if effect.last_resort or refined else 0.0


def _may_come(effect: Effect, out: Effect) -> bool:
    """Whether an effect may take a place by its evidence alone: not what happens once, and a filter only a filter's."""
    once = isinstance(effect, Deterministic) and effect.happens_once
    filtering = isinstance(effect, Modifier) and not isinstance(out, Modifier)
    return not (once or filtering or effect.nameless)

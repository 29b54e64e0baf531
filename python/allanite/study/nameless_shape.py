"""Nameless shape: it replaces a stack of effects of one kind that together only describe one broad shape."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from allanite.effects import Model, Stochastic
from allanite.fit import refitted
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, discrepancy_gain, evidence
from allanite.fit.rivals.together import is_broad
from allanite.study.error_comparison import no_error_rises
from allanite.study.ladder import Rung
from allanite.suggestion.unexplained_shape import nameless

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.result import Fit

__all__ = ["nameless_shape_step"]


def nameless_shape_step(ladder: Sequence[Rung]) -> Rung | None:
    """Step on which a nameless shape replaces a stack of added effects; None if the stack explains more.

    A stack is two or more random effects of one kind, broad bands, or power laws, that the initial model did not have. The
    shape replaces it if its score is higher, where a discrepancy explains nothing. It also replaces a stack that stands for
    an effect of the initial model, such as the white noise, if no discrepancy rises. It raises no error beyond its scatter.
    """
    fit = ladder[-1].fit
    start_kinds = {effect.kind for effect in ladder[0].fit.model}
    count = Counter(effect.kind for effect in fit.model)
    stack = [
        effect
        for effect in fit.model
        if isinstance(effect, Stochastic)
        and effect.kind not in start_kinds
        and (count[effect.kind] > 1 or effect.last_resort or is_broad(effect))
    ]
    if len(stack) < 2:
        return None
    better = refitted(fit, Model((*(e for e in fit.model if e not in stack), nameless())))
    shape = better.model.effects[-1]
    rest = [discrepancy_gain(one.solution, one.data) for one in (fit, better)]
    more = evidence(better.solution) - evidence(fit.solution) + rest[0] - rest[1]
    instead = (
        _stands_for_another(fit, better, start_kinds) and rest[1] < rest[0] + MAX_RIVAL_LOG_EVIDENCE
    )
    if more < MAX_RIVAL_LOG_EVIDENCE and not instead:
        return None
    # The stack may have described chance deviations, so the errors are compared with those before it.
    kinds = {effect.kind for effect in stack}
    unstacked = [rung.fit for rung in ladder if not kinds & {e.kind for e in rung.fit.model}]
    if not no_error_rises(unstacked[-1], better):
        return None
    risen = better.solution.log_likelihood - fit.solution.log_likelihood
    return Rung(better, shape, tuple(effect.kind for effect in stack), risen)


def _stands_for_another(fit: Fit, better: Fit, kinds: set[str]) -> bool:
    """True if an effect of one of these kinds is detected only with the nameless shape, not beside the stack."""
    shown = [
        {e.kind for place, e in enumerate(one.model) if is_detected(one, place)}
        for one in (fit, better)
    ]
    return bool(kinds & (shown[1] - shown[0]))

"""Nameless shape: it replaces a stack of effects of one kind that together only describe one broad shape."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from allanite.effects import Model, Stochastic
from allanite.fit import refitted
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence
from allanite.study.ladder import Rung
from allanite.suggestion.unexplained_shape import nameless

if TYPE_CHECKING:
    from collections.abc import Sequence


__all__ = ["nameless_shape_step"]


def nameless_shape_step(ladder: Sequence[Rung]) -> Rung | None:
    """Step on which a nameless shape replaces a stack of added effects; None if the stack has the higher score.

    A stack is two or more random effects of one kind, or power laws, that the initial model did not have.
    """
    fit = ladder[-1].fit
    start_count = {effect.kind for effect in ladder[0].fit.model}
    count = Counter(effect.kind for effect in fit.model)
    stack = [
        effect
        for effect in fit.model
        if isinstance(effect, Stochastic)
        and effect.kind not in start_count
        and (count[effect.kind] > 1 or effect.last_resort)
    ]
    if len(stack) < 2:
        return None
    better = refitted(fit, Model((*(e for e in fit.model if e not in stack), nameless())))
    shape = better.model.effects[-1]
    if evidence(better.solution) < evidence(fit.solution) + MAX_RIVAL_LOG_EVIDENCE:
        return None
    risen = better.solution.log_likelihood - fit.solution.log_likelihood
    return Rung(better, shape, tuple(effect.kind for effect in stack), risen)

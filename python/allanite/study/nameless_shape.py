"""Where effects of one kind only describe one broad shape, the shape without a name is the better model."""

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


__all__ = ["unstacked"]


def unstacked(ladder: Sequence[Rung]) -> Rung | None:
    """The rung on which a shape without a name takes the place of a stack of added effects, or None where they are better.

    A stack is two or more random effects of one kind, and what describes without explaining, that the start did not have.
    """
    fit = ladder[-1].fit
    asked = {effect.kind for effect in ladder[0].fit.model}
    count = Counter(effect.kind for effect in fit.model)
    stack = [
        effect
        for effect in fit.model
        if isinstance(effect, Stochastic)
        and effect.kind not in asked
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

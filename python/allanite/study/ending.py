"""What stands at the end of a ladder and is not what the record prefers gives way, before the last model is believed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.fit.rivals.evidence import RIVAL, gained
from allanite.study.errors import errors_fall
from allanite.study.ladder import Rung
from allanite.study.moves import swapped

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["exchanged"]


def exchanged(ladder: Sequence[Rung]) -> Rung | None:
    """The rung on which a clearly better effect takes the place of one of the last model; None where none is.

    While effects are added, what is missing beside them has rungs of its own. At the end what came first may stand for
    something that was never the best addition. What has left once takes no place again. The model that was asked about
    gives way only to one with more evidence by `RIVAL`.
    """
    fit = ladder[-1].fit
    gone = {kind for rung in ladder for kind in rung.removed}
    found = swapped(fit, set(range(len(fit.model))), set(), gone)
    if found is None or not errors_fall(fit, found[0]):
        return None
    better, kind, effect = found
    if len(ladder) == 1 and gained(better.solution, fit.solution, fit.data) < RIVAL:
        return None
    start = sum(rung.dropped_start for rung in ladder)
    asked = [e.kind for e in fit.model.effects[: len(ladder[0].fit.model) - start]]
    risen = better.solution.log_likelihood - fit.solution.log_likelihood
    return Rung(better, effect, (kind,), risen, int(kind in asked))

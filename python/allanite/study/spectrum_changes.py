"""Whether an addition changes what the other effects of a model have to explain."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic
from allanite.fit.rivals.alternatives import is_detected

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung

__all__ = ["alone", "bins_moved", "faded", "moved", "rise"]


def moved(before: Fit, after: Fit) -> bool:
    """Whether an addition changes what the others have to explain: in some bin their spectrum, by more than its scatter."""
    return bool(bins_moved(before, after).any())


def rise(before: Fit, after: Fit) -> float:
    """Rise of logL from one fit to another; 0 where it is of other samples, which have another likelihood."""
    counts = [0 if f.data.missing is None else int(f.data.missing.sum()) for f in (before, after)]
    if counts[0] != counts[1]:
        return 0.0
    return after.solution.log_likelihood - before.solution.log_likelihood


def bins_moved(before: Fit, after: Fit) -> NDArray[np.bool_]:
    """Bins in which the spectrum has changed by more than its scatter; all, where there are others."""
    old, new = before.solution.spectrum, after.solution.spectrum
    if old.size != new.size:
        return np.ones(new.size, dtype=bool)
    scatter = np.sqrt(2.0 / np.maximum(after.solution.weight, 1e-9))
    return np.asarray(np.abs(np.log(new / old)) > scatter)


def faded(before: Fit, after: Fit, asked: int) -> bool:
    """Whether one of the effects behind the first `asked` is not seen in the record beside the last."""
    if len(after.model) <= len(before.model):
        return True
    return any(not is_detected(after, place) for place in range(asked, len(before.model)))


def alone(before: Fit, rung: Rung) -> bool:
    """Whether an addition takes nothing from the others: no spectrum has moved, and it is no slow function of time."""
    slow = any(isinstance(effect, Deterministic) and effect.low for effect in rung.new)
    return not slow and not moved(before, rung.fit)

"""Changes of the spectrum by an addition: whether other effects of the model have something else to explain."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic
from allanite.fit.rivals.alternatives import is_detected

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung

__all__ = [
    "changed_bins",
    "changes_spectrum",
    "delta_logl",
    "hides_another",
    "leaves_others_unchanged",
]


def changes_spectrum(before: Fit, after: Fit) -> bool:
    """True if an addition changes the spectrum of the model in some bin by more than its scatter."""
    return bool(changed_bins(before, after).any())


def delta_logl(before: Fit, after: Fit) -> float:
    """ΔlogL from one fit to another; 0 if they use different samples, whose likelihoods are not comparable."""
    counts = [0 if f.data.missing is None else int(f.data.missing.sum()) for f in (before, after)]
    if counts[0] != counts[1]:
        return 0.0
    return after.solution.log_likelihood - before.solution.log_likelihood


def changed_bins(before: Fit, after: Fit) -> NDArray[np.bool_]:
    """Mask of the bins whose model spectrum has changed by more than its scatter; all if the bins differ."""
    old, new = before.solution.spectrum, after.solution.spectrum
    if old.size != new.size:
        return np.ones(new.size, dtype=bool)
    scatter = np.sqrt(2.0 / np.maximum(after.solution.weight, 1e-9))
    return np.asarray(np.abs(np.log(new / old)) > scatter)


def hides_another(before: Fit, after: Fit, start_count: int) -> bool:
    """True if the record no longer shows an effect that the search added, beside the last addition."""
    if len(after.model) <= len(before.model):
        return True
    return any(not is_detected(after, place) for place in range(start_count, len(before.model)))


def leaves_others_unchanged(before: Fit, rung: Rung) -> bool:
    """True if an addition takes nothing from other effects: the spectrum stays, and it is no slow function of time."""
    slow = any(isinstance(effect, Deterministic) and effect.low for effect in rung.new)
    return not slow and not changes_spectrum(before, rung.fit)

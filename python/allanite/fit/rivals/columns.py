"""Whether a column explains the samples, or is like them by chance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic
from allanite.fit.shapes.deterministic import LOW

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["column_slopes", "consistent"]


def consistent(effects: Iterable[Effect], solution: Solution, data: Data) -> bool:
    """Whether those of some effects that follow a column do so with one sign at slow and at fast time scales.

    A chance likeness of two slow series explains the slow half only, and has any sign in the other.
    """
    following = (e for e in effects if isinstance(e, Deterministic) and e.follows is not None)
    found = [column_slopes(effect, solution, data) for effect in following]
    return all(a * b > 0.0 or abs(a - b) < 3.0 * spread for (a, b), spread in filter(None, found))


def column_slopes(
    effect: Deterministic, solution: Solution, data: Data
) -> tuple[tuple[float, float], float] | None:
    """Size of an effect at slow and at fast time scales over the fitted one, and the error of their difference.

    The ordinates are split where half the information on the coefficient lies below. None where one half has none.
    """
    series = effect.signal(data.time, data.covariates)
    j = np.arange(1, min(data.n, LOW), dtype=np.int64)
    z = data.seen(data.transform(series)[j], j)
    variance = solution.noise(data).variance(j)
    weight = z**2 / variance
    split = int(np.searchsorted(np.cumsum(weight), 0.5 * weight.sum())) + 1
    target = solution.ordinates[j] + z
    slow, fast = (
        (float((z[p] * target[p] / variance[p]).sum()), float(weight[p].sum()))
        for p in (slice(None, split), slice(split, None))
    )
    if min(slow[1], fast[1]) <= 0.0:
        return None
    slopes = slow[0] / slow[1], fast[0] / fast[1]
    return slopes, float(np.sqrt(1.0 / slow[1] + 1.0 / fast[1]))

"""Test whether a logged column explains the samples, or only resembles them at slow time scales by chance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic, Effect
from allanite.fit.shapes.deterministic import LOWEST_ORDINATES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution


def follow_columns_consistently(effects: Iterable[Effect], solution: Solution, data: Data) -> bool:
    """True if every effect that follows a logged column has the same sign at slow and at fast time scales.

    An effect also passes if its values at both scales differ by less than three standard errors, or if one scale has no
    information (`column_slopes` returns None). A chance resemblance of two slow series explains only the slow scale, and
    has a random sign at the fast scale.
    """
    following = (e for e in effects if isinstance(e, Deterministic) and e.follows is not None)
    found = [column_slopes(effect, solution, data) for effect in following]
    return all(a * b > 0.0 or abs(a - b) < 3.0 * spread for (a, b), spread in filter(None, found))


def column_slopes(
    effect: Deterministic, solution: Solution, data: Data
) -> tuple[tuple[float, float], float] | None:
    """Pair ((slow, fast), error): coefficient of the effect at slow and at fast time scales, relative to the fitted one.

    `error` is the standard error of the difference of both values. The lowest 8191 ordinates are split in two, so that each
    part has half of the information on the coefficient. None if one part has no information.
    """
    series = effect.signal(data.time, data.covariates)
    j = np.arange(1, min(data.n, LOWEST_ORDINATES), dtype=np.int64)
    z = data.attenuated(data.transform(series)[j], j)
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

"""Multiples of a narrow band: a line that wanders has harmonics, which wander as many times as far."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Model, Stochastic
from allanite.fit import refitted
from allanite.fit.likelihood.peaks import by_ordinates
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.fit.rivals.evidence import RIVAL, evidence

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["harmonics_of"]

#: Highest multiple that is looked at.
HIGHEST = 9
#: Standard deviations by which the power about a multiple must stand out.
STANDS_OUT = 4.0


def harmonics_of(fit: Fit, effect: Effect) -> tuple[Fit, tuple[Effect, ...]]:
    """The fit with the harmonics of a narrow band of its model that the record shows, and these, lowest first.

    Nothing but a few multiples is tried, so that one is believed where its evidence is larger by 3.
    """
    found: list[Effect] = []
    if not isinstance(effect, Stochastic) or not by_ordinates(effect, fit.data):
        return fit, ()
    assert effect.occupies is not None
    low, high = effect.occupies
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    data = fit.data
    white = _power(fit)
    for m in range(2, HIGHEST + 1):
        # The phase of a multiple wanders m times as far: where that is a random walk, its band is m² times as wide.
        wide = m * m * half
        first, last = (round(2.0 * (m * middle + s * wide) * data.duration) for s in (-1.0, 1.0))
        if last >= data.n or first < 1:
            break
        excess = white[first : last + 1]
        count = excess.size
        if (excess.mean() - 1.0) * np.sqrt(0.5 * count) < STANDS_OUT:
            continue
        there = [e.occupies for e in fit.model if e.occupies is not None]
        if any(b > m * middle - wide and a < m * middle + wide for a, b in there):
            continue
        made = effect.banded(m * low, m * high)
        assert made is not None
        power = float(np.sum(fit.solution.ordinates[first : last + 1] ** 2))
        power *= max(1.0 - 1.0 / float(excess.mean()), 0.0) / data.n
        added = made.with_values(**{effect.coefficient: float(np.sqrt(power))})
        better = refitted(fit, Model((*fit.model.effects, added)))
        own = better.model.effects[-1]
        if not by_ordinates(own, data) or own.occupies is None:
            continue
        at = 0.5 * sum(own.occupies)
        close = abs(at - m * middle) < wide
        if close and evidence(better.solution) > evidence(fit.solution) + RIVAL:
            fit, found = better, [*found, own]
            white = _power(fit)
    return fit, tuple(found)


def _power(fit: Fit) -> NDArray[np.float64]:
    """Squared residual ordinates over what the model expects of them, shape (n,)."""
    white = whitened_ordinates(fit.solution, fit.data, np.ones(fit.solution.count.size))
    return np.square(white, out=white)

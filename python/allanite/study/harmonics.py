"""Multiples and side bands of a narrow band: a line that wanders has harmonics, which wander as many times as far."""

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

__all__ = ["with_companions"]

#: Highest multiple that is looked at.
HIGHEST = 9
#: Standard deviations by which the power about a multiple must stand out.
STANDS_OUT = 4.0
#: Least distance of side bands, in half-widths of their carrier, and most, in its frequency.
APART, FARTHEST = 6.0, 0.5


def with_companions(fit: Fit, place: int) -> Fit:
    """The fit with what the record shows of a narrow band, the last of its model: harmonics, behind it, and side bands.

    Each is believed where its evidence is larger by 3.
    """
    fit = _with_harmonics(fit, fit.model.effects[place])
    for each in range(place, len(fit.model)):
        fit = _modulated(fit, each)
    return fit


def _with_harmonics(fit: Fit, effect: Effect) -> Fit:
    """The fit with the harmonics of a narrow band of its model that the record shows, lowest first; few are tried."""
    if not isinstance(effect, Stochastic) or not by_ordinates(effect, fit.data):
        return fit
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
            fit = better
            white = _power(fit)
    return fit


def _modulated(fit: Fit, place: int) -> Fit:
    """The fit with a narrow band of its model, at a `place`, as one that is modulated, where the record shows side bands.

    They are at one distance on both sides of it, and as wide. The distance that is tried is that at which the power of both
    stands out most; the evidence must be larger by 3.
    """
    effect, data = fit.model.effects[place], fit.data
    if not isinstance(effect, Stochastic) or not by_ordinates(effect, data):
        return fit
    assert effect.occupies is not None
    low, high = (2.0 * data.duration * f for f in effect.occupies)
    middle, half = round(0.5 * (low + high)), max(1, round(0.5 * (high - low)))
    first = int(APART * half)
    last = min(int(FARTHEST * middle), data.n - 1 - middle - 2 * half)
    if last - first < 4 * half or effect.modulated(1.0, 1.0) is None:
        return fit
    total = np.cumsum(_power(fit)[middle - last - 2 * half : middle + last + 2 * half + 1])
    mean = (total[2 * half :] - np.append(0.0, total[: -2 * half - 1])) / (2 * half + 1)
    own = mean.size // 2
    sides = np.array([mean[own - last : own - first + 1][::-1], mean[own + first : own + last + 1]])
    # What another effect stands for is no side band of this one.
    for f in (f for e in fit.model if e is not effect for peak in e.peaks for f in peak):
        there = (
            abs(np.arange(first, last + 1) - abs(round(2.0 * data.duration * f) - middle))
            <= 2 * half
        )
        sides[int(2.0 * data.duration * f > middle), there] = 0.0
    score = (sides - 1.0) * np.sqrt(half + 0.5)
    best = int(np.argmax(score.sum(axis=0) * (score.min(axis=0) > 0.5 * STANDS_OUT)))
    if score[:, best].sum() < STANDS_OUT * np.sqrt(2.0) or score[:, best].min() < 0.5 * STANDS_OUT:
        return fit
    apart = first + best
    power = [
        _in_excess(fit, middle + s * apart, half, m)
        for s, m in ((-1, sides[0, best]), (1, sides[1, best]))
    ]
    strength = float(np.mean(power)) / float(effect.values[effect.coefficient]) ** 2
    made = effect.modulated(apart / (2.0 * data.duration), 2.0 * float(np.sqrt(strength)))
    assert made is not None
    effects = list(fit.model.effects)
    effects[place] = made
    better = refitted(fit, Model(tuple(effects)))
    return better if evidence(better.solution) > evidence(fit.solution) + RIVAL else fit


def _in_excess(fit: Fit, middle: int, half: int, mean: float) -> float:
    """Variance in the ordinates about one, less what the model expects there."""
    power = float(np.sum(fit.solution.ordinates[middle - half : middle + half + 1] ** 2))
    return power * max(1.0 - 1.0 / mean, 0.0) / fit.data.n


def _power(fit: Fit) -> NDArray[np.float64]:
    """Squared residual ordinates over what the model expects of them, shape (n,)."""
    white = whitened_ordinates(fit.solution, fit.data, np.ones(fit.solution.count.size))
    return np.square(white, out=white)

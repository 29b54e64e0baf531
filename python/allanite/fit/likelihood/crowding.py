"""Ordinates of a record whose noise level changes, or a band moves: neighbours share the samples that are loud.

White noise of a variance that changes over time has a flat spectrum of which the mean over a wide band scatters as that of
fewer ordinates does: 1/ν of them, ν the mean of the squared power over the square of its mean.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Moving
from allanite.fit.likelihood.expected import at_each_time
from allanite.fit.likelihood.whitened import expected_level

if TYPE_CHECKING:
    from allanite.effects import Model, Stochastic
    from allanite.fit.likelihood.data import Data

__all__ = ["crest", "crowded", "crowding", "uneven"]

#: Stretches in which the level is looked at, and bins to each side of one that say what is about it.
CELLS, ABOUT = 65_536, 7


def uneven(model: Model) -> bool:
    """Whether anything of a model is louder at some times."""
    moving = any(isinstance(effect, Moving) for effect in model.stochastic)
    return moving or any(effect.passing for effect in model.modifiers)


def crowding(model: Model, data: Data) -> float:
    """ν of the model's changes of level, at least 1."""
    power = expected_level(model, data, min(CELLS, data.n))
    return float(np.mean(power**2))


def crest(model: Model, data: Data) -> float:
    """Power of the loudest stretch over the mean."""
    return float(expected_level(model, data, min(CELLS, data.n)).max())


def crowded(model: Model, data: Data) -> NDArray[np.float64]:
    """Degrees of freedom of each bin, shape (bins,): fewer the more of its power the white noise has.

    How much that is, is taken from the record alone, so that models with one change of level are judged alike: the power of
    most ordinates, over what is about a bin.
    """
    bins = data.bins
    power = np.maximum(bins.power(data.ordinates), 1e-300)
    order = np.argsort(power)
    white = power[order][np.searchsorted(np.cumsum(bins.count[order]), 0.5 * bins.count.sum())]
    reach = min(ABOUT, (power.size - 1) // 2)
    about = np.lib.stride_tricks.sliding_window_view(np.pad(power, reach, "edge"), 2 * reach + 1)
    share = np.minimum(1.0, white / np.median(about, axis=1))
    free = bins.count / (1.0 + share**2 * (crowding(model, data) - 1.0))
    middles = (bins.edges[:-1] + bins.edges[1:]) // 2
    for moving in model.stochastic:
        if isinstance(moving, Moving) and moving.middles:
            # Of a band that moves as much as stands out of the white noise; where it is, it is only for a while.
            loud = at_each_time(_of_one_width(moving), middles, data)
            free /= 1.0 + (1.0 - share) ** 2 * (np.mean(loud**2, axis=0) - 1.0)
    times = np.linspace(*data.span, min(CELLS, data.n) + 1)
    for effect in model.modifiers:
        if effect.band is None:
            continue
        low, high = (2.0 * data.n * f / data.rate for f in effect.band)
        inside = np.minimum(bins.edges[1:], high) - np.maximum(bins.edges[:-1], low)
        part = np.clip(inside, 0.0, None) / np.diff(bins.edges)
        power = effect.power_between(times[:-1], times[1:], data.span)
        free /= 1.0 + part * (float(np.mean(power**2)) - 1.0)
    return np.asarray(free)


def _of_one_width(moving: Moving) -> list[Stochastic]:
    """What it is in each part of the record, as wide as an eighth of its course: of any damping the same."""
    places = moving.middles
    half = max((max(places) - min(places)) / 8.0, 1e-6)
    parts = [
        part.banded(f - half, f + half) for part, f in zip(moving.stretches, places, strict=True)
    ]
    return [part for part in parts if part is not None]

"""Ordinates of a record whose noise level changes: neighbours share the samples that are loud.

White noise of a variance that changes over time has a flat spectrum of which the mean over a wide band scatters as that of
fewer ordinates does: 1/ν of them, ν the mean of the squared power over the square of its mean.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.fit.likelihood.whitened import expected_level

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data

__all__ = ["crest", "crowded", "crowding"]

#: Stretches in which the level is looked at, and bins to each side of one that say what is about it.
CELLS, ABOUT = 65_536, 7


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

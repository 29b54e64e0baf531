"""Effective degrees of freedom of bins if the noise level changes over time or a band moves.

Ordinates are then correlated. White noise with changing variance has a flat spectrum, but the mean over n ordinates
scatters like that of n/ν independent ones. ν is the mean of the squared power over the square of the mean power.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.fit.likelihood.expected import relative_power_of_segments
from allanite.fit.likelihood.whitened import expected_level

if TYPE_CHECKING:
    from allanite.effects import Effect, Model, Stochastic
    from allanite.fit.likelihood.data import Data

#: Maximum number of time segments in which the noise level is evaluated. Chosen by judgment; not measured.
MAX_LEVEL_SEGMENTS = 65_536
#: Bins to each side of a bin whose median power represents the spectrum around it. Chosen by judgment; not measured.
BINS_TO_EACH_SIDE = 7


def changing_effects(model: Model) -> tuple[Effect, ...]:
    """Effects of a model that change the noise power over time: level changes and bands of moving frequency.

    Models that differ in these effects have different degrees of freedom, so their likelihoods are not comparable.
    """
    return tuple(e for e in model if e.moving or e.changes_level)


def mean_squared_level(model: Model, data: Data) -> float:
    """Mean over time of p², at least 1; p is the relative power of white noise under the model's level changes."""
    power = expected_level(model, data, min(MAX_LEVEL_SEGMENTS, data.n))
    return float(np.mean(power**2))


def peak_level(model: Model, data: Data) -> float:
    """Maximum over time of the white-noise power under the model's level changes, relative to its mean over time."""
    return float(expected_level(model, data, min(MAX_LEVEL_SEGMENTS, data.n)).max())


def effective_freedom(model: Model, data: Data) -> Array:
    """Degrees of freedom of each bin, shape (bins,); lower if the noise power of the model changes over time.

    For level changes of white noise, the count of a bin is divided by 1 + s²(m − 1), where m is the mean squared relative
    power over time and s is the share of white noise in the bin. s is estimated from the record, not from the model: the
    median power of all ordinates divided by the median power of nearby bins, at most 1. Models with the same changes thus
    have the same degrees of freedom. For a moving band, the factor has 1 − s instead of s, and m is that of its power in
    the bin. For a level change in a band, s is the fraction of the bin inside the band.
    """
    changes = changing_effects(model)
    if not changes:
        return data.bins.count
    return data.of_bins.get(changes, lambda: _reduced_freedom(model, data))


def _reduced_freedom(model: Model, data: Data) -> Array:
    """Array of the degrees of freedom of each bin for a model with `changing_effects`, shape (bins,); not cached."""
    bins = data.bins
    power = np.maximum(data.power, 1e-300)
    order = np.argsort(power)
    white = power[order][np.searchsorted(np.cumsum(bins.count[order]), 0.5 * bins.count.sum())]
    reach = min(BINS_TO_EACH_SIDE, (power.size - 1) // 2)
    about = np.lib.stride_tricks.sliding_window_view(np.pad(power, reach, "edge"), 2 * reach + 1)
    share = np.minimum(1.0, white / np.median(about, axis=1))
    free = bins.count / (1.0 + share**2 * (mean_squared_level(model, data) - 1.0))
    middles = (bins.edges[:-1] + bins.edges[1:]) // 2
    for moving in model.stochastic:
        if moving.middles:
            # Only the part of a moving band above the white noise is correlated.
            loud = relative_power_of_segments(_segments_of_equal_width(moving), middles, data)
            free /= 1.0 + (1.0 - share) ** 2 * (np.mean(loud**2, axis=0) - 1.0)
    times = np.linspace(*data.span, min(MAX_LEVEL_SEGMENTS, data.n) + 1)
    for effect in model.modifiers:
        if effect.band is None:
            continue
        low, high = (2.0 * data.n * f / data.rate for f in effect.band)
        inside = np.minimum(bins.edges[1:], high) - np.maximum(bins.edges[:-1], low)
        part = np.clip(inside, 0.0, None) / np.diff(bins.edges)
        power = effect.power_between(times[:-1], times[1:], data.span)
        free /= 1.0 + part * (float(np.mean(power**2)) - 1.0)
    return np.asarray(free)


def _segments_of_equal_width(moving: Stochastic) -> list[Stochastic]:
    """List of processes, one for each time segment: a band of common half-width at the frequency of the moving band there.

    The half-width is 1/8 of the range of these frequencies; the damping of the moving band is not used. Segments whose
    process cannot be such a band (`banded` returns None) are omitted.
    """
    places = moving.middles
    half = max((max(places) - min(places)) / 8.0, 1e-6)
    parts = [
        part.banded(f - half, f + half) for part, f in zip(moving.segments, places, strict=True)
    ]
    return [part for part in parts if part is not None]

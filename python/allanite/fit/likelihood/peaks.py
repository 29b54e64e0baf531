"""Narrow bands: bins are too wide for them, so their densities are evaluated at single ordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import Effect, Model, Stochastic

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.likelihood.data import Data
    from allanite.spectrum import Bins

Ordinates = NDArray[np.int64]
#: A band narrower than this fraction of its center frequency is fitted to single ordinates. Bins are 1.2 % wide and
#: cannot resolve narrower bands.
MAX_NARROW_WIDTH = 0.012
#: Number of bins to either side of a narrow band in which single ordinates are used. Chosen by judgment; not measured.
BINS_BESIDE_BAND = 3
#: Places, in half-widths from the middle of a band, at which its density is interpolated. They are dense near the
#: middle and reach to 548 half-widths. Chosen by judgment; not measured.
INTERPOLATION_PLACES = np.sinh(np.linspace(-7.0, 7.0, 141))
#: Maximum number of ordinates near a band that are summed one by one; with more, the density is interpolated.
#: Chosen by judgment; not measured.
MAX_SUMMED_ORDINATES = 1 << 13
#: Places, in half-widths from the middle, between which the density is linear in sums over many ordinates.
#: With them and `SUM_PLACES_PER_BIN` the sums are at most 2e-4 off.
SUM_PLACES = np.sinh(np.linspace(-12.0, 12.0, 1201))
#: Number of additional places in each bin between which the density is linear in these sums.
SUM_PLACES_PER_BIN = 64
#: Maximum fraction of missing samples with which single ordinates are used: the leakage between ordinates is small.
#: Benchmark: narrow bands with 5 % and 10 % of the samples missing (`benches/claims/narrow_bands.py`).
MAX_MISSING_FRACTION = 0.1


def is_narrow(effect: Effect) -> bool:
    """True if the effect is a band narrower than 1.2 % of its center frequency, the width of a bin."""
    if not isinstance(effect, Stochastic) or effect.occupies is None:
        return False
    low, high = effect.occupies
    return 0.0 < high - low < 0.5 * MAX_NARROW_WIDTH * (low + high)


def has_all_ordinates(data: Data) -> bool:
    """True if all single ordinates are kept (not in a summary), and at most 10 % of the samples are missing."""
    return data.whole and data.lost <= MAX_MISSING_FRACTION


def has_ordinates_near(effect: Effect, data: Data) -> bool:
    """True if the single ordinates near a band are kept, and at most 10 % of the samples are missing."""
    if data.lost > MAX_MISSING_FRACTION:
        return False
    return data.whole or bool(
        data.bins.edges[bins_near(effect, data.bins, data.rate)[-1] + 1] <= data.ordinates.size
    )


def is_fitted_to_ordinates(effect: Effect, data: Data) -> bool:
    """True if the shapes of an effect are fitted to single ordinates (cosine-transform coefficients) instead of bins.

    The effect must be a narrow band whose shapes are all free and can be given by two band limits (`banded`).
    """
    if not is_narrow(effect) or not has_ordinates_near(effect, data):
        return False
    assert isinstance(effect, Stochastic)
    free = len(effect.free_shapes) == sum(p.role == "shape" for p in effect.parameters)
    return free and effect.banded(1.0, 1.001) is not None


def bins_near(effect: Effect, bins: Bins, rate: float) -> Ordinates:
    """Indices of bins near the peaks of an effect, ascending: the bin of each peak and three on either side."""
    middles = np.reshape(effect.peaks, (-1, 2)).sum(axis=1) * bins.n / rate
    places = np.maximum(np.searchsorted(bins.edges, middles, side="right") - 1, 0)
    around = places[:, None] + np.arange(-BINS_BESIDE_BAND, BINS_BESIDE_BAND + 1)
    return np.unique(around.clip(0, bins.edges.size - 2))


def ordinates_of_bins(near: Ordinates, bins: Bins) -> Ordinates:
    """Array of the indices of all ordinates in the bins with indices `near`, bin after bin."""
    return np.concatenate([np.arange(bins.edges[b], bins.edges[b + 1]) for b in near])


def means_near(
    effect: Effect, bins: Bins, rate: float, density: Callable[[Ordinates], Array]
) -> tuple[Ordinates, Array]:
    """Pair of arrays: indices of the bins in or near a narrow band, and the mean of `density` over each bin's ordinates.

    Up to 8192 ordinates are summed, more are interpolated. (Bins are usually evaluated at a few nodes, which would miss the
    band.)
    """
    near = bins_near(effect, bins, rate)
    first, end = bins.edges[near], bins.edges[near + 1]
    if int((end - first).sum()) <= MAX_SUMMED_ORDINATES:
        starts = np.cumsum(end - first) - (end - first)
        return near, np.add.reduceat(density(ordinates_of_bins(near, bins)), starts) / (end - first)
    at = _ordinates_around_peaks(effect, bins, rate, SUM_PLACES)
    spread = [
        np.linspace(a, b, SUM_PLACES_PER_BIN).astype(np.int64)
        for a, b in zip(first, end, strict=True)
    ]
    j = np.unique(np.concatenate([at[(at > first[0]) & (at < end[-1])], *spread]))
    known = density(j)
    # Trapezoid sum over all ordinates from each place up to, but excluding, the next place.
    m = np.diff(j)
    sums = np.cumsum(np.append(0.0, m * known[:-1] + 0.5 * (m - 1) * np.diff(known)))
    return near, (sums[np.searchsorted(j, end)] - sums[np.searchsorted(j, first)]) / (end - first)


def _ordinates_around_peaks(effect: Effect, bins: Bins, rate: float, places: Array) -> Ordinates:
    """Array of ordinates around each peak of an effect, at the distances `places` in half-widths from its center."""
    low, high = np.array(effect.peaks).T[:, :, None] * 2.0 * bins.n / rate
    at = 0.5 * (low + high) + 0.5 * (high - low) * places
    return np.round(at).astype(np.int64).ravel()


def nodes_of(model: Model, bins: Bins, rate: float) -> NDArray[np.int64]:
    """Array of the ordinates at which a model's density is evaluated for interpolation, denser near narrow bands."""
    places = [bins.nodes]
    for effect in model:
        if is_narrow(effect):
            at = _ordinates_around_peaks(effect, bins, rate, INTERPOLATION_PLACES)
            owner = np.searchsorted(bins.edges, at, side="right") - 1
            places.append(at[np.isin(owner, bins_near(effect, bins, rate))])
    return bins.nodes if len(places) == 1 else np.unique(np.concatenate(places))

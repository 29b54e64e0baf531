"""Bands narrower than a bin: what single ordinates say of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Model, Stochastic

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.effects import Effect
    from allanite.fit.likelihood.data import Data
    from allanite.spectrum import Bins

__all__ = ["by_ordinates", "is_narrow", "means_near", "nodes_of", "reach_of", "seen_singly"]

Ordinates = NDArray[np.int64]
#: Width of a band, in parts of its frequency, below which bins, which are 1.2 % wide, do not show it.
NARROW = 0.012
#: Bins to either side of a narrow band of which single ordinates are looked at.
BESIDE = 3
#: Ordinates of a band at which its density is interpolated, in half-widths from its middle.
PLACES = np.sinh(np.linspace(-7.0, 7.0, 141))
#: As many ordinates near a band are summed one by one; of more, these, in half-widths from its middle, between which the
#: density is taken for a line: the sums are at most 2e-4 off.
SINGLY, CLOSER = 1 << 13, np.sinh(np.linspace(-12.0, 12.0, 1201))


def is_narrow(effect: Effect) -> bool:
    """Whether it is a band that bins do not show."""
    if not isinstance(effect, Stochastic) or effect.occupies is None:
        return False
    low, high = effect.occupies
    return 0.0 < high - low < 0.5 * NARROW * (low + high)


def seen_singly(data: Data) -> bool:
    """Whether every ordinate is kept (not those of a summary) and shows itself alone (not where samples are missing)."""
    return data.gain is None and data.ordinates.size == data.n


def by_ordinates(effect: Effect, data: Data) -> bool:
    """Whether the shapes of an effect are fitted to single ordinates: of a narrow band, where the record has them all."""
    if not is_narrow(effect) or not seen_singly(data):
        return False
    assert isinstance(effect, Stochastic)
    free = len(effect.free_shapes) == sum(p.role == "shape" for p in effect.parameters)
    return free and effect.banded(1.0, 1.001) is not None


def reach_of(effect: Effect, bins: Bins, rate: float) -> tuple[int, int]:
    """First bin, and the one after the last, that a band is in or near."""
    assert effect.occupies is not None
    middle = sum(effect.occupies) * bins.n / rate
    place = int(np.searchsorted(bins.edges, middle, side="right")) - 1
    return max(0, place - BESIDE), min(bins.edges.size - 1, max(place, 0) + BESIDE + 1)


def means_near(
    effect: Effect, bins: Bins, rate: float, density: Callable[[Ordinates], NDArray[np.float64]]
) -> tuple[slice, NDArray[np.float64]]:
    """The bins that a narrow band is in or near, and the means of its `density` there: the nodes of a bin miss it."""
    first, last = reach_of(effect, bins, rate)
    edges = bins.edges[first : last + 1]
    if edges[-1] - edges[0] <= SINGLY:
        j = np.arange(edges[0], edges[-1])
        sums = np.add.reduceat(density(j), edges[:-1] - edges[0])
        return slice(first, last), sums / np.diff(edges)
    low, high = _ordinates_of(effect, bins, rate)
    at = 0.5 * (low + high) + 0.5 * (high - low) * CLOSER
    at = np.round(at[(at > edges[0]) & (at < edges[-1])]).astype(np.int64)
    j = np.unique(np.concatenate([at, edges, np.geomspace(edges[0], edges[-1], 512).astype(int)]))
    known = density(j)
    # From each of them up to the next, that left out.
    m = np.diff(j)
    pieces = m * known[:-1] + 0.5 * (m - 1) * np.diff(known)
    sums = np.add.reduceat(pieces, np.searchsorted(j, edges[:-1]))
    return slice(first, last), sums / np.diff(edges)


def _ordinates_of(effect: Effect, bins: Bins, rate: float) -> NDArray[np.float64]:
    """The ends of a band, in ordinates."""
    return np.array(effect.occupies) * 2.0 * bins.n / rate


def nodes_of(model: Model, bins: Bins, rate: float) -> NDArray[np.int64]:
    """Ordinates between which a model's density is smooth: the nodes of the bins, and more about narrow bands."""
    places = [bins.nodes]
    for effect in model:
        if is_narrow(effect):
            low, high = _ordinates_of(effect, bins, rate)
            at = np.round(0.5 * (low + high) + 0.5 * (high - low) * PLACES).astype(np.int64)
            first, last = reach_of(effect, bins, rate)
            inside = (at >= bins.edges[first]) & (at < bins.edges[last])
            places.append(at[inside])
    return bins.nodes if len(places) == 1 else np.unique(np.concatenate(places))

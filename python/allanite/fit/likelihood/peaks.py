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

__all__ = [
    "FEW",
    "bins_near",
    "by_ordinates",
    "is_narrow",
    "means_near",
    "near_seen_singly",
    "nodes_of",
    "seen_singly",
    "within",
]

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
#: Where no more than this share of the samples is missing, an ordinate shows next to nothing but itself.
FEW = 0.1
#: And in each bin so many.
SPREAD = 64


def is_narrow(effect: Effect) -> bool:
    """Whether it is a band that bins do not show."""
    if not isinstance(effect, Stochastic) or effect.occupies is None:
        return False
    low, high = effect.occupies
    return 0.0 < high - low < 0.5 * NARROW * (low + high)


def seen_singly(data: Data) -> bool:
    """Whether every ordinate is kept (not those of a summary) and shows itself alone: next to no sample is missing."""
    return data.ordinates.size == data.n and data.lost <= FEW


def near_seen_singly(effect: Effect, data: Data) -> bool:
    """Whether the ordinates about a band are: a summary has the lowest."""
    if data.lost > FEW:
        return False
    return bool(
        data.bins.edges[bins_near(effect, data.bins, data.rate)[-1] + 1] <= data.ordinates.size
    )


def by_ordinates(effect: Effect, data: Data) -> bool:
    """Whether the shapes of an effect are fitted to single ordinates: of a narrow band, where the record has them all."""
    if not is_narrow(effect) or not near_seen_singly(effect, data):
        return False
    assert isinstance(effect, Stochastic)
    free = len(effect.free_shapes) == sum(p.role == "shape" for p in effect.parameters)
    return free and effect.banded(1.0, 1.001) is not None


def bins_near(effect: Effect, bins: Bins, rate: float) -> Ordinates:
    """The bins that its bands are in, and those beside them."""
    found: set[int] = set()
    for band in effect.peaks:
        middle = sum(band) * bins.n / rate
        place = int(bins.edges.searchsorted(middle, side="right")) - 1
        found.update(
            range(max(0, place - BESIDE), min(bins.edges.size - 2, max(place, 0) + BESIDE) + 1)
        )
    return np.array(sorted(found), dtype=np.int64)


def within(near: Ordinates, bins: Bins) -> Ordinates:
    """Every ordinate of some bins."""
    return np.concatenate([np.arange(bins.edges[b], bins.edges[b + 1]) for b in near])


def means_near(
    effect: Effect, bins: Bins, rate: float, density: Callable[[Ordinates], NDArray[np.float64]]
) -> tuple[Ordinates, NDArray[np.float64]]:
    """The bins that a narrow band is in or near, and the means of its `density` there: the nodes of a bin miss it."""
    near = bins_near(effect, bins, rate)
    first, end = bins.edges[near], bins.edges[near + 1]
    if int((end - first).sum()) <= SINGLY:
        starts = np.cumsum(end - first) - (end - first)
        return near, np.add.reduceat(density(within(near, bins)), starts) / (end - first)
    at = _about(effect, bins, rate, CLOSER)
    spread = [np.linspace(a, b, SPREAD).astype(np.int64) for a, b in zip(first, end, strict=True)]
    j = np.unique(np.concatenate([at[(at > first[0]) & (at < end[-1])], *spread]))
    known = density(j)
    # From each of them up to the next, that left out.
    m = np.diff(j)
    sums = np.cumsum(np.append(0.0, m * known[:-1] + 0.5 * (m - 1) * np.diff(known)))
    return near, (sums[np.searchsorted(j, end)] - sums[np.searchsorted(j, first)]) / (end - first)


def _about(effect: Effect, bins: Bins, rate: float, places: NDArray[np.float64]) -> Ordinates:
    """Ordinates at some places of each band, in half-widths from its middle."""
    low, high = np.array(effect.peaks).T[:, :, None] * 2.0 * bins.n / rate
    at = 0.5 * (low + high) + 0.5 * (high - low) * places
    return np.round(at).astype(np.int64).ravel()


def nodes_of(model: Model, bins: Bins, rate: float) -> NDArray[np.int64]:
    """Ordinates between which a model's density is smooth: the nodes of the bins, and more about narrow bands."""
    places = [bins.nodes]
    for effect in model:
        if is_narrow(effect):
            at = _about(effect, bins, rate, PLACES)
            owner = np.searchsorted(bins.edges, at, side="right") - 1
            places.append(at[np.isin(owner, bins_near(effect, bins, rate))])
    return bins.nodes if len(places) == 1 else np.unique(np.concatenate(places))

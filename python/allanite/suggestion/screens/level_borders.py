"""When the level of a series of power changes: between two values, or within those of a map."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["between_values", "moved", "of_stretches", "within_cells"]

Array = NDArray[np.float64]
#: Values on each side of a border of the power map of a summary that may mix two levels.
BLURRED_VALUES = 12
#: Most alternations between borders and levels; a few suffice.
MAX_ROUNDS = 20


def moved(power: Array, places: NDArray[np.int64], levels: Array, least: int) -> NDArray[np.int64]:
    """Each border where it is most likely between the levels on its sides, anywhere between its neighbours.

    A stretch between two keeps at least `least` values: anything shorter is an outlier, not a level. The ends of the record
    are no borders, and stay.
    """
    out = places.copy()
    for k, place in enumerate(places):
        before, after = levels[k], levels[k + 1]
        low = out[k - 1] + least if k else 1
        high = places[k + 1] - least if k + 1 < places.size else power.size - 1
        if before == after or high <= low or not 0 < place < power.size:
            continue
        some = power[low:high]
        worse = np.log(before / after) + some * (1.0 / before - 1.0 / after)
        out[k] = low + int(np.argmin(np.concatenate([[0.0], np.cumsum(worse)])))
    return out


def between_values(
    power: Array, places: NDArray[np.int64], factors: Sequence[float], least: int
) -> NDArray[np.int64]:
    """Borders where the likelihood of the values is largest, and the levels that follow from them with it.

    Where a border is found among coarse stretches it is off by as much as the record tells better by many units of logL:
    levels that are known with it move it, and it moves them, until it stays.
    """
    for _ in range(MAX_ROUNDS):
        before, places = places, moved(power, places, of_stretches(power, places, factors), least)
        if np.array_equal(before, places):
            break
    return places


def of_stretches(power: Array, places: NDArray[np.int64], factors: Sequence[float]) -> Array:
    """Mean power of each stretch, of one for all of the same of the `factors`, that of the first being 1."""
    known = np.array([1.0, *factors])
    ends = [0, *places, power.size]
    total = np.array([power[low:high].sum() for low, high in pairwise(ends)])
    size = np.diff(ends)
    alike = known[:, np.newaxis] == known
    return np.asarray(np.maximum(alike @ total / np.maximum(alike @ size, 1), 1e-12))


def within_cells(
    power: Array, places: Sequence[float], factors: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Borders of levels within the values of a map over time, and the power from each on over that at the start.

    A value of such a map may be a mean over more than its own time. What is known of the levels is what is well inside
    their stretches, of one for all that have one of the `factors`; about each border is as much power as the levels on both
    sides make.
    """
    known = [1.0, *factors]
    at = np.arange(power.size) + 0.5

    def levels(borders: Sequence[float]) -> list[float]:
        ends = [0.0, *borders, float(power.size)]
        inside: dict[float, list[Array]] = {}
        for factor, (low, high) in zip(known, pairwise(ends), strict=True):
            aside = min(BLURRED_VALUES, 0.25 * (high - low))
            first, last = low + aside * (low > 0.0), high - aside * (high < power.size)
            inside.setdefault(factor, []).append(power[(first < at) & (at < last)])
        means = {factor: np.concatenate(parts) for factor, parts in inside.items()}
        return [
            float(means[factor].mean()) if means[factor].size else factor**2 for factor in known
        ]

    out = list(places)
    for _ in range(2):
        level, ends = levels(out), [0.0, *out, float(power.size)]
        for k, (low, place, high) in enumerate(zip(ends[:-2], ends[1:-1], ends[2:], strict=True)):
            first = round(max(0.5 * (low + place), place - BLURRED_VALUES))
            last = round(min(0.5 * (place + high), place + BLURRED_VALUES))
            before, after = level[k], level[k + 1]
            if last > first and before != after:
                excess = float((power[first:last] - before).sum())
                out[k] = float(np.clip(last - excess / (after - before), first, last))
    level = levels(out)
    return out, [one / level[0] for one in level[1:]]

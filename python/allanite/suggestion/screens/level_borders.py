"""Times at which the level of a power series changes: between two values, or within the cells of a map."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.suggestion.p_values import delta_logl_of_two_levels

if TYPE_CHECKING:
    from collections.abc import Sequence

Array = NDArray[np.float64]
#: Number of values on each side of a border, in the power map of a summary, that may mix two levels.
BLURRED_VALUES = 12
#: Maximum number of alternations between borders and levels; a few suffice.
MAX_ROUNDS = 20


def most_likely_borders(
    power: Array, places: NDArray[np.int64], levels: Array, min_values: int
) -> NDArray[np.int64]:
    """The borders `places` between constant levels, each moved to its most likely index in `power`.

    A border is the index of the first value after it. `levels` are the mean powers of all intervals. An interval between
    two borders keeps at least `min_values` values, since anything shorter is an outlier.
    """
    out = places.copy()
    for k, place in enumerate(places):
        before, after = levels[k], levels[k + 1]
        low = out[k - 1] + min_values if k else 1
        high = places[k + 1] - min_values if k + 1 < places.size else power.size - 1
        if before == after or high <= low or not 0 < place < power.size:
            continue
        some = power[low:high]
        worse = some * (1.0 / before - 1.0 / after)  # of a long record, in place
        worse += np.log(before / after)
        np.cumsum(worse, out=worse)
        best = int(np.argmin(worse))
        out[k] = low + (best + 1 if worse[best] < 0.0 else 0)
    return out


def borders_between_values(
    power: Array, places: NDArray[np.int64], factors: Sequence[float], min_values: int
) -> NDArray[np.int64]:
    """Most likely borders between intervals of constant noise level, as indices of `power`, from the start values `places`.

    Borders and levels are refined alternately. Intervals with the same entry in `factors` share one level. An interval
    keeps at least `min_values` values.
    """
    for _ in range(MAX_ROUNDS):
        before, places = (
            places,
            most_likely_borders(power, places, interval_powers(power, places, factors), min_values),
        )
        if np.array_equal(before, places):
            break
    return places


def refined_interval(
    power: Array, freedom: float, start: int, end: int, min_values: int
) -> tuple[int, int, float]:
    """Tuple (start, end, ΔlogL): interval of the series `power` with most likely ends, and the ΔlogL of its own mean.

    The ends are refined from the given ones. `freedom` is the degrees of freedom of each value. The interval keeps at least
    `min_values` values.
    """
    start, end = borders_between_values(
        power, np.array([start, end]), (2.0, 1.0), min_values
    ).tolist()
    inside, size = np.array([power[start:end].sum()]), np.array([float(end - start)])
    gain = delta_logl_of_two_levels(inside, size, float(power.sum()), float(power.size), freedom)
    return start, end, float(gain[0])


def interval_powers(
    power: Array, places: NDArray[np.int64], factors: Sequence[float] | Array
) -> Array:
    """Mean power, at least 1e-12, of each interval between borders; intervals with the same factor have one mean.

    `places` are the borders, `factors` those of the intervals after each border; the first interval has the factor 1.
    """
    _, level = np.unique([1.0, *factors], return_inverse=True)
    ends = [0, *places, power.size]
    sums = [power[low:high].sum() for low, high in pairwise(ends)]
    total, size = (np.bincount(level, weights=values) for values in (sums, np.diff(ends)))
    return np.asarray(np.maximum(total / np.maximum(size, 1.0), 1e-12)[level])


def borders_within_cells(
    power: Array, places: Sequence[float], factors: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Pair of lists: index in `power` of each level change, with a fraction; and power after it relative to the start.

    A value of `power`, a series over time, may mix the levels before and after a change. `places` are estimates of the
    indices, `factors` the levels after each change (square roots of power); equal factors have one mean. Values within 12
    of a change are omitted from the means. The sum of the power near a change gives its index.
    """
    known = [1.0, *factors]
    at = np.arange(power.size) + 0.5

    def levels(borders: Sequence[float]) -> list[float]:
        """Mean power of each interval between the given borders, or the square of its factor if no values remain."""
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

"""Bands of a record over time: what their ordinates do, and what is expected of them where it is not always the same."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects import Moving, weights
from allanite.fit.likelihood.expected import at_each_time, density

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Modifier
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution

__all__ = [
    "band_of",
    "in_time",
    "moving_power",
    "share_of",
    "shares_about",
    "steady",
    "steady_course",
]

#: Edges of cells about the middle of a band, in half-widths, and the share from which a process is seen in one.
ASIDES = (0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 6.0, 9.0, 13.0, 20.0, 30.0)
ABOUT, SEEN = (*(-a for a in ASIDES[::-1]), 0.0, *ASIDES), 0.01
#: The same beside the course of a band that moves.
BESIDE = (*ASIDES[3:], 45.0, 65.0, 95.0, 140.0)


def steady(white: NDArray[np.float64], effect: Modifier, solution: Solution, data: Data) -> None:
    """Divide white ordinates of a band whose level changes by what is expected at each time, in place.

    Of a process as much of them as it has: its share is taken for constant in cells about its middle.
    """
    assert effect.band is not None
    owners = [p for p in solution.processes if effect.swells(p.effect)]
    cells = [c for own in owners for c in shares_about(own, solution, data, white.size)]
    if not owners:
        cells = [(*band_of(effect.band, data, white.size), 1.0)]
    for first, size, share in cells:
        edges = np.linspace(*data.span, size + 2)
        power = effect.power_between(edges[:-1], edges[1:], data.span)
        _divide(white[first : first + size], 1.0 + share * (power - 1.0))


def steady_course(
    white: NDArray[np.float64], own: Process, moving: Moving, solution: Solution, data: Data
) -> None:
    """Divide white ordinates about a band that moves by what is expected of it at each time, in place."""
    if moving.occupies is None:
        return
    low, high = (2.0 * f * data.n / data.rate for f in moving.occupies)
    places = (p.occupies for p in moving.stretches if p.occupies is not None)
    narrow = min((b - a) * data.n / data.rate for a, b in places)
    inside = np.arange(low, high, max(narrow, 2.0))
    aside = 0.5 * narrow * np.array(BESIDE)
    edges = np.concatenate((low - aside, inside, high + aside))
    edges = np.unique(np.round(edges).astype(np.int64).clip(1, white.size))
    middles = (edges[:-1] + edges[1:]) // 2
    loud = at_each_time(moving.stretches, middles, data)
    for first, last, power, middle in zip(edges[:-1], edges[1:], loud.T, middles, strict=True):
        share = share_of(own, solution, data, int(middle))
        size = int(last - first)
        if share > SEEN and size > 1:
            times = np.linspace(*data.span, size + 1)
            there = power @ weights(times, data.span, power.size)
            _divide(white[first:last], 1.0 + share * (there - 1.0))


def moving_power(
    solution: Solution, data: Data, j: NDArray[np.int64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Power of ordinates j at some times over their mean, shape (times, ordinates), by bands that move."""
    power = np.ones((times.size, j.size))
    for own in solution.processes:
        if isinstance(own.effect, Moving) and own.theta:
            loud = at_each_time(own.effect.stretches, j, data)
            there = weights(times, data.span, loud.shape[0]).T @ loud
            share = _shares(own, solution, data, j)
            power *= 1.0 + share * (there - 1.0)
    return power


def _divide(band: NDArray[np.float64], power: NDArray[np.float64]) -> None:
    """Divide ordinates of a band by the root of a power over time, in place."""
    band[:] = _kernels.cosine_transform(in_time(band) / np.sqrt(power))[1:]


def shares_about(
    process: Process, solution: Solution, data: Data, n: int
) -> Iterator[tuple[int, int, float]]:
    """First ordinate, size and share of a process in cells about each of its peaks, below ordinate n."""
    for low, high in process.effect.peaks:
        middle, half = ((high + s * low) * data.n / data.rate for s in (1.0, -1.0))
        edges = np.unique(np.round(middle + half * np.array(ABOUT)).clip(1, n).astype(np.int64))
        for first, last in pairwise(edges.tolist()):
            share = share_of(process, solution, data, (first + last) // 2)
            if share > SEEN:
                yield first, last - first, share


def share_of(process: Process, solution: Solution, data: Data, ordinate: int) -> float:
    """Part of the model's density at an ordinate that a process makes."""
    return float(_shares(process, solution, data, np.array([ordinate]))[0])


def _shares(
    process: Process, solution: Solution, data: Data, j: NDArray[np.int64]
) -> NDArray[np.float64]:
    total = density(data.terms(solution.model), j, data.n)
    own = density(data.unit_terms(solution.model, process.effect), j, data.n)
    return np.asarray(process.theta * own / total)


def band_of(band: tuple[float, float], data: Data, n: int) -> tuple[int, int]:
    """The first ordinate of a band, Hz, and about as many below n as it has, so that their transform is quick."""
    from scipy.fft import next_fast_len

    first, last = (round(2.0 * data.n * f / data.rate) for f in band)
    size = next_fast_len(max(last - first, 1)) - 1
    return max(1, min(first, n - size)), min(size, n - 1)


def in_time(band: NDArray[np.float64]) -> NDArray[np.float64]:
    """The series of which these are all ordinates but the lowest: what a band of a record does over time."""
    return _kernels.inverse_cosine_transform(np.concatenate([[0.0], band]))

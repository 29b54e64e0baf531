"""Power of frequency bands over time, for bands whose level changes or whose frequency moves."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.effects import Modifier, Stochastic, segment_weights
from allanite.fit.likelihood.expected import density_by, relative_power_of_segments

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution

#: Upper edges of frequency cells above the middle of a band, in half-widths of the band; cells widen as the band's power
#: falls. Chosen by judgment; not measured.
CELL_EDGES = (0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 6.0, 9.0, 13.0, 20.0, 30.0)
#: Edges of cells to both sides of the middle of a band, in half-widths.
CELL_EDGES_BOTH_SIDES = (*(-a for a in CELL_EDGES[::-1]), 0.0, *CELL_EDGES)
#: Minimum fraction of a cell's density that a process must make for the cell to be corrected over time.
#: Chosen by judgment; not measured.
MIN_CELL_SHARE = 0.01
#: Edges of cells outside the range of frequencies over which a band moves, in half-widths from its ends.
#: Chosen by judgment; not measured.
CELL_EDGES_OUTSIDE = (*CELL_EDGES[3:], 45.0, 65.0, 95.0, 140.0)


def remove_level_change(white: Array, effect: Modifier, solution: Solution, data: Data) -> None:
    """Divide a band's change of level out of the whitened ordinates `white`, in place.

    If the change belongs to processes of the model, the frequency cells around their peaks are changed (`cell_shares`).
    Otherwise all ordinates of the frequency band `effect.band` are changed. Their time series is divided by √g,
    g = 1 + s(p − 1), with the expected relative power p over time and the share s of the process in the density (or 1).
    """
    assert effect.band is not None
    owners = [p for p in solution.processes if effect.changes_level_of(p.effect)]
    cells = [c for own in owners for c in cell_shares(own, solution, data, white.size)]
    if not owners:
        cells = [(*band_ordinates(effect.band, data, white.size), 1.0)]
    for first, size, share in cells:
        edges = np.linspace(*data.span, size + 2)
        power = effect.power_between(edges[:-1], edges[1:], data.span)
        _divide_by_root(white[first : first + size], 1.0 + share * (power - 1.0))


def remove_motion(
    white: Array, own: Process, moving: Stochastic, solution: Solution, data: Data
) -> None:
    """Divide the changes caused by a band of moving frequency out of the whitened ordinates `white`, in place.

    The time series of each cell of frequency near the band is divided by the root of its expected relative power. Cells in
    which the band has at most 1 % of the power, or with a single ordinate, are not changed.
    """
    if moving.occupies is None:
        return
    low, high = (2.0 * f * data.n / data.rate for f in moving.occupies)
    places = (p.occupies for p in moving.segments if p.occupies is not None)
    narrow = min((b - a) * data.n / data.rate for a, b in places)
    inside = np.arange(low, high, max(narrow, 2.0))
    aside = 0.5 * narrow * np.array(CELL_EDGES_OUTSIDE)
    edges = np.concatenate((low - aside, inside, high + aside))
    edges = np.unique(np.round(edges).astype(np.int64).clip(1, white.size))
    middles = (edges[:-1] + edges[1:]) // 2
    loud = relative_power_of_segments(moving.segments, middles, data)
    shares = density_shares(own, solution, data, middles)
    for first, last, power, share in zip(edges[:-1], edges[1:], loud.T, shares, strict=True):
        size = int(last - first)
        if share > MIN_CELL_SHARE and size > 1:
            # The power changes linearly from the middle of one segment to the next (`weights`).
            index = (np.arange(size + 1) / size) * power.size - 0.5
            there = np.interp(index, np.arange(power.size), power)
            _divide_by_root(white[first:last], 1.0 + share * (there - 1.0))


def moving_power(solution: Solution, data: Data, j: NDArray[np.int64], times: Array) -> Array:
    """Power over time, relative to its mean, at ordinates j, shape (times, ordinates); only moving bands change it."""
    power = np.ones((times.size, j.size))
    for own in solution.processes:
        if own.effect.moving and own.theta:
            loud = relative_power_of_segments(own.effect.segments, j, data)
            there = segment_weights(times, data.span, loud.shape[0]).T @ loud
            share = density_shares(own, solution, data, j)
            power *= 1.0 + share * (there - 1.0)
    return power


def _divide_by_root(band: Array, power: Array) -> None:
    """Divide the time series of a band of ordinates by √`power`, shape (ordinates + 1,) (`band_series`), in place."""
    band[:] = _kernels.cosine_transform(band_series(band) / np.sqrt(power))[1:]


def cell_shares(
    process: Process, solution: Solution, data: Data, n: int
) -> Iterator[tuple[int, int, float]]:
    """Iterator over (first ordinate, number of ordinates, share) of frequency cells around the peaks of a process.

    The share, 0 … 1, is the part of the model's spectral density that the process makes at the middle of the cell. Cells
    end before ordinate `n`. Cells with a share of at most 1 % are omitted.
    """
    for low, high in process.effect.peaks:
        middle, half = ((high + s * low) * data.n / data.rate for s in (1.0, -1.0))
        edges = np.unique(
            np.round(middle + half * np.array(CELL_EDGES_BOTH_SIDES)).clip(1, n).astype(np.int64)
        )
        shares = density_shares(process, solution, data, (edges[:-1] + edges[1:]) // 2)
        for (first, last), share in zip(pairwise(edges.tolist()), shares.tolist(), strict=True):
            if share > MIN_CELL_SHARE:
                yield first, last - first, share


def density_shares(process: Process, solution: Solution, data: Data, j: NDArray[np.int64]) -> Array:
    """Array of the share, 0 … 1, of the model's density at each ordinate j that a process makes, shape of j."""
    evaluator = _kernels.Ordinates(j, data.n)
    total = density_by(evaluator, data.terms(solution.model), data.n)
    own = density_by(evaluator, data.unit_terms(solution.model, process.effect), data.n)
    return np.asarray(process.theta * own / total)


def band_ordinates(band: tuple[float, float], data: Data, n: int) -> tuple[int, int]:
    """Pair (first, number) of the ordinates of a frequency band (low, high), Hz; the record has `n` ordinates.

    The number is raised until a transform of number + 1 values is fast, but is at most n − 1.
    """
    from scipy.fft import next_fast_len

    first, last = (round(2.0 * data.n * f / data.rate) for f in band)
    size = next_fast_len(max(last - first, 1)) - 1
    return max(1, min(first, n - size)), min(size, n - 1)


def band_series(band: Array) -> Array:
    """Time series of a band, shape (ordinates + 1,): inverse cosine transform of 0 and its consecutive ordinates."""
    return _kernels.inverse_cosine_transform(np.concatenate([[0.0], band]))

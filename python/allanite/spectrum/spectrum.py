"""Spectra: cosine-transform ordinates in log-spaced bins.

For white noise and for random walks, the ordinate at f_j = j·rate/2n has exactly the variance S(f_j), and ordinates are
uncorrelated (derived in rust/spectrum.rs). The mean square of a bin of k ordinates therefore follows χ²_k/k.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array, runs_of
from allanite.common.documents import rows_of
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.common.validation import check_size, positive_rate

if TYPE_CHECKING:
    from allanite.recording import Recording

#: Cells per decade of frequency, each 10 % wide: a corner or peak of a physical effect covers several cells.
CELLS_PER_DECADE = 24
#: Groups of bins per decade in which χ² is computed: physical effects are broad on a logarithmic axis, and χ² is more
#: powerful with fewer terms.
GROUPS_PER_DECADE = 10
#: Maximum number of bins of a cell, and minimum number of ordinates of such a bin. Bins resolve features narrower than a
#: cell.
MAX_BINS_PER_CELL, MIN_BIN_ORDINATES = 8, 32
#: Number of ordinates of a whole cell at which a model is evaluated; each bin of a divided cell has at least two.
NODES_PER_CELL = 8
#: Ordinates per node above which nodes are placed by Gauss-Legendre quadrature instead of evenly.
MIN_ORDINATES_PER_NODE = 4


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False)
class Bins:
    """Log-spaced bins of the ordinates j = 1…n−1 of n samples.

    Bin b holds ordinates edges[b] … edges[b+1]−1. `count` are its degrees of freedom: its ordinates, fewer where
    samples are missing. `nodes` are the ordinates at which models are evaluated, and `owner` the bin of each. `groups`
    has the first bin of each group, ten groups per decade.
    """

    n: int
    edges: NDArray[np.int64]
    count: Array
    nodes: NDArray[np.int64]
    owner: NDArray[np.int64]
    groups: NDArray[np.int64]

    __repr__ = brief

    def mean(self, values: Array) -> Array:
        """Array of the mean over each bin, shape (bins,), of a function with these `values` at the ordinates `nodes`."""
        weight = np.bincount(self.owner)
        return np.asarray(np.bincount(self.owner, weights=values) / weight)

    def power(self, ordinates: Array) -> Array:
        """Mean square of the cosine-transform coefficients `ordinates` in each bin; the first, j = 0, is not used."""
        return _kernels.squares(ordinates, self.edges) / np.diff(self.edges)

    def folded(self, ordinates: Array, folds: int) -> tuple[Array, Array]:
        """Number and sum of squares of the ordinates of each cross-validation fold in each bin, shape (folds, bins).

        Fold k has the ordinates with index j mod `folds` = k.
        """
        number = np.empty((folds, self.count.size))
        total = np.empty_like(number)
        for fold in range(folds):
            own = ordinates[fold::folds]
            # First of the fold's ordinates at or above each edge.
            edges = (self.edges - fold + folds - 1) // folds
            number[fold] = np.diff(edges)
            squares = np.append(own * own, 0.0)
            sums = np.add.reduceat(squares, edges[:-1])
            total[fold] = np.where(number[fold] > 0, sums, 0.0)
        return number, total

    def frequency(self, rate: float) -> Array:
        """Array of the center frequency of each bin, Hz, shape (bins,): geometric mean of its first and last ordinate."""
        center = np.sqrt(self.edges[:-1] * (self.edges[1:] - 1.0))
        return center * rate / (2.0 * self.n)

    def limits(self, rate: float) -> tuple[Array, Array]:
        """Pair (lower, upper) of arrays, shape (bins,): the frequency limits of the bins, Hz."""
        half = rate / (2.0 * self.n)
        edges = (self.edges.astype(np.float64) - 0.5) * half
        return edges[:-1], edges[1:]


@lru_cache(maxsize=1)
def _endless_bins() -> tuple[list[int], list[int]]:
    """First ordinate of each bin, from 1 to at least 2⁵³, and index of the first bin of each cell; cached.

    Cells divide the ordinates into 24 intervals per decade of frequency. A cell of 64 or more ordinates is divided into
    up to 8 bins of at least 32 ordinates; a smaller cell is one bin.
    """
    edges, cells = [1], []
    while edges[-1] < 2**53:
        low = edges[-1]
        high = max(low + 1, int(np.ceil(low * 10 ** (1 / CELLS_PER_DECADE))))
        parts = int(np.clip((high - low) // MIN_BIN_ORDINATES, 1, MAX_BINS_PER_CELL))
        cells.append(len(edges) - 1)
        edges += [low + (high - low) * (i + 1) // parts for i in range(parts)]
    return edges, cells


@lru_cache(maxsize=64)
def cells_of(bins: int) -> list[int]:
    """First bin of each cell (1/24 decade, or a single ordinate) that begins in the lowest `bins` bins; cached."""
    return [cell for cell in _endless_bins()[1] if cell < bins]


@lru_cache(maxsize=2 * NODES_PER_CELL)
def _node_positions(count: int, wide: bool) -> Array:
    """Positions, as fractions of the width of a bin, of `count` nodes whose mean is a model's mean over the bin; cached.

    The nodes are evenly spaced, or in a `wide` bin pairs of the two-point Gauss-Legendre rule.
    """
    even = (np.arange(count) + 0.5) / count
    if count % 2 or not wide:
        return even
    # ±1/√3 of half a pair's share instead of ±½.
    return even + np.tile([-1.0, 1.0], count // 2) * (1.0 / np.sqrt(3.0) - 0.5) / count


@lru_cache(maxsize=32)
def bins_of(n: int) -> Bins:
    """`Bins` of the cosine-transform coefficients of n samples, with read-only arrays; cached."""
    edges = [edge for edge in _endless_bins()[0] if edge < n]
    edges.append(n)
    # A last bin much narrower than its neighbor is merged with it.
    if len(edges) > 3 and edges[-1] - edges[-2] < 0.5 * (edges[-2] - edges[-3]):
        del edges[-2]
    nodes, owner = [], []
    cells = np.array([*cells_of(len(edges) - 1), len(edges) - 1])
    parts = np.repeat(np.diff(cells), np.diff(cells))
    for b, (low, high) in enumerate(itertools.pairwise(edges)):
        width, count = high - low, max(2, NODES_PER_CELL // int(parts[b]))
        count = min(width, count)
        inside = low + np.floor(
            _node_positions(count, width >= MIN_ORDINATES_PER_NODE * count) * width
        ).astype(np.int64)
        nodes.append(inside)
        owner.append(np.full(inside.size, b))
    limits = np.array(edges, dtype=np.int64)
    groups = [0]
    for b in cells[:-1].tolist():
        low = edges[b]
        if low >= edges[groups[-1]] * 10 ** (1 / GROUPS_PER_DECADE) - 1e-9:
            groups.append(b)
    arrays = (
        limits,
        np.diff(limits).astype(float),
        np.concatenate(nodes),
        np.concatenate(owner),
        np.unique(np.array(groups, dtype=np.int64)),
    )
    for array in arrays:
        array.flags.writeable = False
    return Bins(n, *arrays)


def bridge_gaps(samples: NDArray[Any], missing: NDArray[np.bool_] | None = None) -> Array:
    """The samples as float64, shape (n,), in which NaN and samples flagged in `missing` have plausible values.

    Each run of missing samples is bridged by a straight line between the means of up to 8 samples on each side. White
    noise with the record's own sample-to-sample scatter (fixed seed) is added, so that neither steps nor quiet segments
    appear. Raises `TooShortError` if fewer than two samples are present.
    """
    values = np.ascontiguousarray(samples, dtype=np.float64)
    bad = np.isnan(values)
    if missing is not None:
        bad = bad | missing
    if not bad.any():
        return values
    good = ~bad
    if good.sum() < 2:
        raise TooShortError("all samples are missing: nothing is left to analyze")
    values = values.copy()
    steps = np.diff(values[good])
    # For a normal distribution the median absolute deviation is Φ⁻¹(¾) σ = σ/1.4826.
    scatter = 1.4826 * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
    noise = np.random.default_rng(0).standard_normal(int(bad.sum())) * scatter
    index = np.flatnonzero(good)
    for start, end in zip(*runs_of(bad), strict=True):
        at = int(np.searchsorted(index, start))
        left = values[index[max(0, at - 8) : at]]
        right = values[index[at : at + 8]]
        a = left.mean() if left.size else right.mean()
        b = right.mean() if right.size else a
        values[start:end] = np.linspace(a, b, end - start + 2)[1:-1]
    values[bad] += noise
    return values


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Two-sided power spectral density in log-spaced bins.

    Attributes
    ----------
    frequency, low_hz, high_hz : ndarray, shape (bins,)
        Center and limits of each bin, Hz.
    density : ndarray, shape (bins,)
        Two-sided density, U²/Hz (white level N²).
    low, high : ndarray, shape (bins,)
        95 % interval of the density (χ² with `count` degrees of freedom).
    count : ndarray, shape (bins,)
        Ordinates in the bin.

    Examples
    --------
    >>> found = al.psd(al.AngleRandomWalk(N=0.1).simulate(duration=1000, rate=10, seed=1))
    >>> sorted(found.to_dict())
    ['points', 'schema', 'sided']
    """

    frequency: Array
    low_hz: Array
    high_hz: Array
    density: Array
    low: Array
    high: Array
    count: Array
    unit: str = "1"

    __repr__ = brief

    def __str__(self) -> str:
        lines = [
            f"{'f (Hz)':>12} {'density two-sided':>18} {'95 % low':>12} {'high':>12} {'count':>8}"
        ]
        lines += [
            f"{f:12.5g} {d:18.5g} {lo:12.5g} {hi:12.5g} {int(c):8d}"
            for f, d, lo, hi, c in zip(
                self.frequency, self.density, self.low, self.high, self.count, strict=True
            )
        ]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/psd/1``: frequency, density and its 95 % interval of each bin."""
        return {
            "schema": "allanite/psd/1",
            "sided": "two-sided",
            "points": rows_of(
                frequency_hz=self.frequency, density=self.density, low=self.low, high=self.high
            ),
        }


def psd(x: ArrayLike | Recording, rate: float | None = None) -> Spectrum:
    """`Spectrum`: two-sided power spectral density of a record in log-spaced bins.

    Parameters
    ----------
    x : array_like or Recording
        Rate samples, shape (n,), unit U. NaN are bridged (`bridge_gaps`).
    rate : float, optional
        Sampling rate in Hz; taken from a recording, 1 for a bare array.

    Returns
    -------
    Spectrum

    Raises
    ------
    InputError
        A rate that is not positive, a record of several columns, or samples whose fourth powers are no doubles.
    TooShortError
        Fewer than 8 samples.

    References
    ----------
    Makhoul, J. (1980). A fast cosine transform in one and two dimensions. IEEE Trans. ASSP 28, 27: the transform
    (DCT-II), which a record that does not return to its beginning does not disturb.

    Examples
    --------
    The density is two-sided: white noise of coefficient N has the density N².

    >>> found = al.psd(al.AngleRandomWalk(N=0.1).simulate(duration=1000, rate=10, seed=1))
    >>> print(np.average(found.density, weights=found.count).round(3))
    0.01
    """
    from scipy.special import chdtri

    samples = x.rate_samples() if hasattr(x, "rate_samples") else np.asarray(x)
    fs = positive_rate(rate if rate is not None else getattr(x, "rate", 1.0))
    if samples.ndim != 1:
        raise InputError(f"a spectrum needs one column, found an array of shape {samples.shape}")
    if samples.size < 8:
        raise TooShortError(f"a spectrum needs at least 8 samples, found {samples.size}")
    bins = bins_of(samples.size)
    filled = bridge_gaps(samples)
    check_size(filled, "the record", "a spectrum")
    density = bins.power(_kernels.cosine_transform(filled)) / fs
    low_hz, high_hz = bins.limits(fs)
    low = density * bins.count / chdtri(bins.count, 0.025)
    high = density * bins.count / chdtri(bins.count, 0.975)
    unit = str(getattr(x, "unit", "1"))
    return Spectrum(bins.frequency(fs), low_hz, high_hz, density, low, high, bins.count, unit)

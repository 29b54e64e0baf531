"""Share of the power in each ordinate that missing samples leave unknown, and its effect on bin power.

With Φ the cosines of the ordinates at the present samples and S the variances of the ordinates, the known share is
1 − r_j = S_j φ_jᵀ (Φ S Φᵀ)⁻¹ φ_j minus a correction for the free mean. Records of at most `MAX_CELLS` samples solve this
exactly. Longer records are averaged into that many cells, which gives the lowest ordinates; these hardly change within a
cell. A cell with missing samples is represented by its mean plus noise. All other ordinates are estimated from draws.

Gaps also mix the power of ordinates (`mixing_of`), and bins keep less information (`known_ordinates`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.memory import cleared_by_free_buffers

if TYPE_CHECKING:
    from allanite.spectrum import Bins

Mask = NDArray[np.bool_]

#: Maximum number of cells, and of samples of a record whose shares are solved exactly. Chosen by judgment; not measured.
MAX_CELLS = 512
#: Minimum number of cells per half period of an ordinate whose share is taken from cell means, if few cells contain
#: missing samples. With this value the known share is accurate to 1.5 %.
CELLS_PER_ORDINATE = 4
#: The same minimum if many cells contain both present and missing samples; the same accuracy of 1.5 %.
CELLS_PER_ORDINATE_PARTIAL = 16
#: Maximum fraction of cells with both present and missing samples that counts as few. Chosen by judgment; not measured.
MAX_PARTIAL_FRACTION = 0.1
#: Minimum number of squared ordinates of the draws in one average. Chosen by judgment; not measured.
MIN_AVERAGED_ORDINATES = 64
#: Minimum width of one average, relative to the frequency or to its distance from half the sampling rate (there regular
#: gaps show the lowest ordinates). Chosen by judgment; not measured.
MIN_AVERAGE_WIDTH = 0.3
#: Maximum number of ordinates used to find the noise variance that matches the number of missing samples.
#: Chosen by judgment; not measured.
MAX_BALANCED_ORDINATES = 1 << 16
#: Minimum known share of an ordinate; smaller shares are raised to it, to keep divisions by the share stable.
#: Chosen by judgment; not measured.
MIN_KNOWN_SHARE = 0.02


def unknown_share(
    missing: Mask, spectrum: Array, drawn: tuple[Array, Array] | None, bins: Bins
) -> Array:
    """Unknown share r, 0 … 0.98, of the power of each ordinate, shape (n,); r at j = 0 has no meaning.

    `spectrum`, shape (n,), is the variance S of each ordinate. `drawn` are mean squared ordinates of the unknown and of the
    known part of random records. It is None for at most `MAX_CELLS` samples, of which `unknown_share_of_lowest` computes
    all ordinates. Otherwise, all but the lowest are a rough share times a correction from `drawn`, which changes slowly
    over frequency. The sum of all shares is made equal to the number of missing samples.
    """
    lowest, empty = unknown_share_of_lowest(missing, spectrum)
    share = np.zeros(missing.size)
    first = 1 + lowest.size
    share[1:first] = lowest
    if drawn is not None:
        left = max(float(missing.sum()) - lowest.sum(), 0.0)
        rough = _rough_share(spectrum[first:], left, empty)
        # Combine both estimates by inverse variance; the variance of a power is twice its square.
        weight = (1.0 - rough) ** 2 / ((1.0 - rough) ** 2 + rough**2)
        unseen, seen = (part[first:] / spectrum[first:] for part in drawn)
        found = rough * _smoothed_ratio(
            weight * unseen + (1.0 - weight) * (1.0 - seen), rough, first, bins
        )
        share[first:] = found * (left / found.sum())
    return np.clip(share, 0.0, 1.0 - MIN_KNOWN_SHARE)


def unknown_share_of_lowest(missing: Mask, spectrum: Array) -> tuple[Array, float]:
    """Pair (r, empty): unknown share of the power of each of the lowest ordinates j = 1, 2, …, and fraction in long gaps.

    The record is divided into at most 512 cells of neighboring samples. `empty` is the fraction of samples in cells that
    are entirely missing. For at most 512 samples, r is for all n − 1 ordinates. Otherwise it is for the lowest 128, or for
    the lowest 32 if at least 10 % of the cells are partly missing.
    """
    from scipy.linalg import cho_factor, cho_solve

    n = missing.size
    cells = min(MAX_CELLS, n)
    edges = np.arange(cells + 1, dtype=np.int64) * n // cells
    size = np.diff(edges)
    there = 1.0 - np.add.reduceat(missing.astype(np.float64), edges[:-1]) / size
    j = np.arange(1, cells)
    # Averaging in cells attenuates an ordinate and adds its alias.
    passed = np.sin(np.pi * j / (2 * cells)) / (n / cells * np.sin(np.pi * j / (2 * n)))
    image = spectrum[np.minimum(2 * cells - j, n - 1)]
    power = np.zeros(2 * cells)
    power[1:cells] = passed**2 * spectrum[j] + (1.0 - passed**2) * image
    # Σ_j S_j φ_j(i) φ_j(k) depends on i − k and on i + k + 1.
    covariance = np.fft.fft(power).real / cells
    i = np.flatnonzero(there > 0.0)
    between = covariance[np.abs(i[:, None] - i)] + covariance[i[:, None] + i + 1]
    # Rounding errors of the transform may exceed the power of the highest ordinates of a steep spectrum.
    rounding = np.finfo(np.float64).eps * power.sum()
    between[np.arange(i.size), np.arange(i.size)] += (
        _noise_variance(1.0 - there[i], spectrum) + rounding
    )
    partly = np.mean((there > 0.0) & (there < 1.0))
    count = (
        cells - 1
        if cells == n
        else cells
        // (CELLS_PER_ORDINATE if partly < MAX_PARTIAL_FRACTION else CELLS_PER_ORDINATE_PARTIAL)
    )
    phi = np.sqrt(2.0 / cells) * np.cos(np.pi / cells * np.outer(i + 0.5, j[:count]))
    right_sides = np.column_stack([np.ones(i.size), phi])
    solved = cho_solve(cho_factor(between, lower=True), right_sides)
    gain = (
        np.einsum("ij,ij->j", right_sides, solved)[1:]
        - (solved[:, 0] @ phi) ** 2 / solved[:, 0].sum()
    )
    return 1.0 - power[1 : count + 1] * gain, float(size[there == 0.0].sum()) / n


def _noise_variance(unseen: Array, spectrum: Array) -> Array:
    """Variances v of white noise that hides as much of the record as the fractions `unseen` of missing samples.

    White noise of variance v hides the fraction v/(v + S) of an ordinate with variance S. v is chosen so that the mean of
    this fraction over the `spectrum` S equals `unseen`.
    """
    part = spectrum[1 :: max(1, spectrum.size // 4096)]
    v = np.geomspace(part.min() * 1e-6, part.max() * 1e6, 240)
    mean = np.array([np.mean(each / (each + part)) for each in v])
    return np.where(unseen > 0.0, np.exp(np.interp(unseen, mean, np.log(v))), 0.0)


def _rough_share(spectrum: Array, missing: float, empty: float) -> Array:
    """Approximate share of each ordinate that gaps leave unknown, shape of `spectrum`.

    The share is f + (1 − f)·v/(v + S), with S of the `spectrum` and the fraction f of samples in long gaps (`empty`). White
    noise of variance v stands for the short gaps. v is chosen so that the sum of the shares is about `missing`, the number
    of missing samples.
    """
    # A subset of the ordinates determines v well enough.
    part = spectrum[:: max(1, spectrum.size // MAX_BALANCED_ORDINATES)]
    mean = missing / spectrum.size
    low, high = part.min() * 1e-6, part.max() * 1e6
    for _ in range(60):
        v = np.sqrt(low * high)
        found = np.mean(empty + (1.0 - empty) * v / (v + part))
        low, high = (v, high) if found < mean else (low, v)
    return np.asarray(empty + (1.0 - empty) * v / (v + spectrum))


def _smoothed_ratio(values: Array, rough: Array, start: int, bins: Bins) -> Array:
    """Ratio of `values` to `rough`: one ratio of sums per frequency band, interpolated linearly in ln j.

    The arrays have one value for each ordinate j ≥ `start`. A band consists of whole bins and has at least 64 ordinates, or
    all. Its width, except for the last, is at least 0.3 times the distance to the nearer end of the spectrum.
    """
    first = [start]
    for edge in bins.edges[bins.edges > start][:-1].tolist():
        if edge - first[-1] >= max(
            MIN_AVERAGED_ORDINATES, MIN_AVERAGE_WIDTH * min(edge, bins.n - edge)
        ):
            first.append(edge)
    if len(first) > 1 and bins.n - first[-1] < MIN_AVERAGED_ORDINATES:
        first.pop()
    edges = np.array([*first, bins.n], dtype=np.float64)
    places = np.array(first) - start
    ratio = np.add.reduceat(values, places) / np.add.reduceat(rough, places)
    centers = np.log(np.sqrt(edges[:-1] * (edges[1:] - 1.0)))
    return np.asarray(np.interp(np.log(np.arange(start, bins.n, dtype=float)), centers, ratio))


def _coupling(missing: Mask) -> Array:
    """Squared correlations that gaps cause between ordinates of white noise, in two terms, shape (2n,).

    The squared correlation of ordinates i and j is the sum of the elements at |i − j| and at i + j.
    """
    n = missing.size
    # Σ_k mask_k cos(πh(k+½)/n)/n; beyond n it repeats backwards with the opposite sign.
    transform = _kernels.cosine_transform(missing.astype(np.float64)) * np.sqrt(0.5 / n)
    transform[0] = 0.0
    return np.asarray(np.concatenate([transform, [0.0], transform[:0:-1]]) ** 2)


@cleared_by_free_buffers
@lru_cache(maxsize=4)
def _squared_correlations_cached(packed: bytes, n: int, edges: bytes) -> Array:
    """`squared_correlations`, cached for `packed`, the mask of n samples from `numpy.packbits`, and the int64 `edges`.

    Intervals of every fit of a search need them, and they take 0.2 s for a million samples.
    """
    missing = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=n).astype(bool)
    return squared_correlations(missing, np.frombuffer(edges, dtype=np.int64))


def squared_correlations(missing: Mask, edges: NDArray[np.int64]) -> Array:
    """Sum of the squared correlations that gaps cause between the ordinates of two bins, shape (bins, bins).

    The sum is over all pairs of one ordinate of each bin, for white noise. `edges` are the first ordinates of the bins and
    the end of the last.
    """
    squared = _coupling(missing)
    n = missing.size
    # With a double cumulative sum, the sum of a function of j − i or j + i over a rectangle takes four values.
    both = np.cumsum(np.cumsum(np.concatenate([squared[n - 1 : 0 : -1], squared])))

    def corner(at: NDArray[np.int64]) -> Array:
        """Double cumulative sum of the squared correlations at indices `at`; 0 before its start."""
        return np.where(at < 0, 0.0, both[np.maximum(at, 0)])

    low, high = edges[:-1], edges[1:]
    offset = n - 1  # `both` begins at j − i = −(n − 1)
    a, b, c, d = low[:, None], high[:, None], low[None], high[None]
    apart = corner(b - c + offset - 1) - corner(a - c + offset - 1)
    apart = apart - corner(b - d + offset - 1) + corner(a - d + offset - 1)
    total = corner(b + d - 2 + offset) - corner(a + d - 2 + offset)
    total = total - corner(b + c - 2 + offset) + corner(a + c - 2 + offset)
    return np.asarray(apart + total)


def known_ordinates(share: Array, bins: Bins) -> Array:
    """Effective number of ordinates in each bin that gaps leave known, Σ (1 − share), shape (bins,).

    The sum over all bins is the number of samples present, minus one for the mean.
    """
    return np.asarray(np.add.reduceat(1.0 - share, bins.edges[:-1]))


def mixing_of(missing: Mask, share: Array, bins: Bins) -> Array:
    """Change of the observed power of bin a (row) per change of true power of bin b (column), shape (bins, bins).

    Changes are relative, and each row sums to 1. r is the mean unknown share (`share`) of the ordinates of a bin. In row a,
    the diagonal gets 1 − r of bin a. All bins b divide the rest r in proportion to their weights. The weight of b is the
    mean of share·(1 − share) over b, times the sum of the squared correlations between the ordinates of a and b. The
    weights hold because the unknown part, divided by √S, is a projection.
    """
    number = np.diff(bins.edges).astype(float)
    unknown = np.add.reduceat(share, bins.edges[:-1]) / number
    source = np.add.reduceat(share * (1.0 - share), bins.edges[:-1]) / number
    edges = np.ascontiguousarray(bins.edges, dtype=np.int64)
    pairs = _squared_correlations_cached(
        np.packbits(missing).tobytes(), missing.size, edges.tobytes()
    )
    coupled = np.maximum(pairs, 0.0) * source
    total = coupled.sum(axis=1)
    out = coupled * (unknown / np.maximum(total, 1e-300))[:, None]
    at = np.arange(number.size)
    out[at, at] += np.where(total > 0.0, 1.0 - unknown, 1.0)
    return np.asarray(out)

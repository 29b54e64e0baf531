"""Share of the power in each ordinate that missing samples leave unknown.

With Φ the cosines of the ordinates at the present samples and S the variances of the ordinates, the known share is
1 − r_j = S_j φ_jᵀ (Φ S Φᵀ)⁻¹ φ_j minus a correction for the free mean. Records of at most `MAX_CELLS` samples solve this
exactly. Longer records are averaged into that many cells, which gives the lowest ordinates; these hardly change within a
cell. A cell with missing samples is represented by its mean plus noise. All other ordinates are estimated from draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array

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

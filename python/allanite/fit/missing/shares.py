"""What share of the power in each ordinate holes leave unknown.

With Φ the ordinates' cosines at the samples that are there and S their variances, 1 − r_j = S_j φ_jᵀ (Φ S Φᵀ)⁻¹ φ_j less
what the free mean takes: the gain of the filling on ordinate j. That is solved for of a record of at most `CELLS` samples.
Of a longer one it is solved for of the means of that many cells, for the lowest ordinates, which hardly change within a
cell; a cell that is seen in part is its mean and noise. All other ordinates are found from draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from allanite.spectrum import Bins

__all__ = ["CELLS", "lowest_share", "share_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Cells of a record, and how many of them an ordinate has that is asked of their means, to 1.5 % of what is seen of it:
#: where few cells are seen in part, and else; which share is few.
CELLS, PER_ORDINATE, PARTLY, FEW = 512, 4, 16, 0.1
#: Squared ordinates averaged of the draws, at least, and the share that they span of the frequency or of its distance
#: from half the rate, where regular holes show the lowest ones.
SMOOTH, SPAN = 64, 0.3
#: Ordinates among which shares are balanced.
ENOUGH = 1 << 16
#: Ordinates seen to no more than this share are left out.
LEAST_SEEN = 0.02


def share_of(
    missing: Mask, spectrum: Array, drawn: tuple[Array, Array] | None, bins: Bins
) -> Array:
    """The share r of each ordinate that is not known, shape (n,); that of j = 0, the mean, says nothing.

    Parameters
    ----------
    missing : ndarray of bool, shape (n,)
    spectrum : ndarray, shape (n,)
        S.
    drawn : tuple of ndarray, shape (n,), or None
        Mean squared ordinates of drawn parts that the samples leave unknown, and of those that they show; None of a
        record of at most `CELLS` samples.
    bins : Bins

    Notes
    -----
    Holes like noise of variance v on the samples would leave r = v/(v + S), long ones f + (1 − f)v/(v + S) with f the
    share of the samples in them; what they are instead changes slowly over frequency. Σ_j r_j = tr(Q_mm⁻¹ Q_mm) is the
    number of missing samples, whatever the spectrum.
    """
    lowest, empty = lowest_share(missing, spectrum)
    share = np.zeros(missing.size)
    first = 1 + lowest.size
    share[1:first] = lowest
    if drawn is not None:
        left = max(float(missing.sum()) - lowest.sum(), 0.0)
        rough = _rough(spectrum[first:], left, empty)
        # Each power scatters by twice its square.
        weight = (1.0 - rough) ** 2 / ((1.0 - rough) ** 2 + rough**2)
        unseen, seen = (part[first:] / spectrum[first:] for part in drawn)
        found = rough * _smooth(weight * unseen + (1.0 - weight) * (1.0 - seen), rough, first, bins)
        share[first:] = found * (left / found.sum())
    return np.clip(share, 0.0, 1.0 - LEAST_SEEN)


def lowest_share(missing: Mask, spectrum: Array) -> tuple[Array, float]:
    """The share r of the lowest ordinates from j = 1 on, and that of the samples which are in cells without any."""
    from scipy.linalg import cho_factor, cho_solve

    n = missing.size
    cells = min(CELLS, n)
    edges = np.arange(cells + 1, dtype=np.int64) * n // cells
    size = np.diff(edges)
    there = 1.0 - np.add.reduceat(missing.astype(np.float64), edges[:-1]) / size
    j = np.arange(1, cells)
    # A mean passes less of an ordinate, and as much of its mirror image.
    passed = np.sin(np.pi * j / (2 * cells)) / (n / cells * np.sin(np.pi * j / (2 * n)))
    image = spectrum[np.minimum(2 * cells - j, n - 1)]
    power = np.zeros(2 * cells)
    power[1:cells] = passed**2 * spectrum[j] + (1.0 - passed**2) * image
    # Σ_j S_j φ_j(i) φ_j(k) depends on i − k and on i + k + 1.
    covariance = np.fft.fft(power).real / cells
    i = np.flatnonzero(there > 0.0)
    between = covariance[np.abs(i[:, None] - i)] + covariance[i[:, None] + i + 1]
    between[np.arange(i.size), np.arange(i.size)] += _noise(1.0 - there[i], spectrum)
    partly = np.mean((there > 0.0) & (there < 1.0))
    count = cells - 1 if cells == n else cells // (PER_ORDINATE if partly < FEW else PARTLY)
    phi = np.sqrt(2.0 / cells) * np.cos(np.pi / cells * np.outer(i + 0.5, j[:count]))
    asked = np.column_stack([np.ones(i.size), phi])
    solved = cho_solve(cho_factor(between, lower=True), asked)
    gain = np.einsum("ij,ij->j", asked, solved)[1:] - (solved[:, 0] @ phi) ** 2 / solved[:, 0].sum()
    return 1.0 - power[1 : count + 1] * gain, float(size[there == 0.0].sum()) / n


def _noise(unseen: Array, spectrum: Array) -> Array:
    """Variance v, as if on every sample, of cells of which this share is missing: the mean of v/(v + S) is that share."""
    part = spectrum[1 :: max(1, spectrum.size // 4096)]
    v = np.geomspace(part.min() * 1e-6, part.max() * 1e6, 240)
    mean = np.array([np.mean(each / (each + part)) for each in v])
    return np.where(unseen > 0.0, np.exp(np.interp(unseen, mean, np.log(v))), 0.0)


def _rough(spectrum: Array, missing: float, empty: float) -> Array:
    """Shares of these ordinates that sum to about the number of missing samples."""
    # Of many ordinates some are enough.
    part = spectrum[:: max(1, spectrum.size // ENOUGH)]
    mean = missing / spectrum.size
    low, high = part.min() * 1e-6, part.max() * 1e6
    for _ in range(60):
        v = np.sqrt(low * high)
        found = np.mean(empty + (1.0 - empty) * v / (v + part))
        low, high = (v, high) if found < mean else (low, v)
    return np.asarray(empty + (1.0 - empty) * v / (v + spectrum))


def _smooth(values: Array, rough: Array, start: int, bins: Bins) -> Array:
    """Values over rough ones, of wide stretches, spread over the ordinates from `start` on by straight lines in ln j."""
    first = [start]
    for edge in bins.edges[bins.edges > start][:-1].tolist():
        if edge - first[-1] >= max(SMOOTH, SPAN * min(edge, bins.n - edge)):
            first.append(edge)
    if len(first) > 1 and bins.n - first[-1] < SMOOTH:
        first.pop()
    edges = np.array([*first, bins.n], dtype=np.float64)
    places = np.array(first) - start
    ratio = np.add.reduceat(values, places) / np.add.reduceat(rough, places)
    centres = np.log(np.sqrt(edges[:-1] * (edges[1:] - 1.0)))
    return np.asarray(np.interp(np.log(np.arange(start, bins.n, dtype=float)), centres, ratio))

"""Filling of missing samples of a stream from the samples around them. A single pass has no fitted model for this."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, runs_of
from allanite.common.errors import TooShortError

Places = NDArray[np.int64]
#: Maximum length, in samples, of a missing run that is filled by random draws. A draw uses this number of neighbors on
#: each side. The sweeps over all runs are repeated this number of times.
MAX_DRAWN_RUN, NEIGHBORS, SWEEPS = 16, 24, 2


def fill_missing(x: Array) -> Array:
    """Copy of `x` with missing samples (NaN) replaced by plausible values; `x` itself if no sample is missing.

    A run of more than 16 samples, or within 24 samples of an end, is filled by mirror images of both sides. Any other run
    is a normal draw given its neighbors, with the autocovariance of all samples. The fill preserves the spectrum and is
    reproducible. `TooShortError` if all samples are missing.
    """
    bad = np.isnan(x)
    if not bad.any():
        return x
    if bad.all():
        raise TooShortError("all samples are missing: nothing is left to analyze")
    starts, ends = runs_of(bad)
    out = _fill_by_mirror_images(x, bad, starts, ends)
    _redraw_short_runs(out, ~bad, starts, ends - starts)
    return out


def _fill_by_mirror_images(x: Array, bad: NDArray[np.bool_], starts: Places, ends: Places) -> Array:
    """Copy of `x` in which each missing run `starts` … `ends` − 1 is filled by mirror images of both sides.

    A run of k samples is the line between the means of k samples on each side, plus the mirrored deviations from these
    means. The squares of the weights of both sides sum to 1, so that the run has the noise level of its surroundings at all
    frequencies. If a mirror image lacks a sample, only the other one is used; if both lack it, only the line.
    """
    sizes = ends - starts
    total = np.concatenate([[0.0], np.cumsum(np.where(bad, 0.0, x))])
    seen = np.concatenate([[0], np.cumsum(~bad)])
    first, last = np.maximum(starts - sizes, 0), np.minimum(ends + sizes, x.size)
    count = [seen[starts] - seen[first], seen[last] - seen[ends]]
    sums = [total[starts] - total[first], total[last] - total[ends]]
    level = [s / np.maximum(c, 1) for s, c in zip(sums, count, strict=True)]
    # At an end of the record only one side exists. If both sides are missing, the mean of all samples is used.
    whole = np.full(starts.size, float(np.mean(x[~bad])))
    before = np.where(count[0] > 0, level[0], np.where(count[1] > 0, level[1], whole))
    behind = np.where(count[1] > 0, level[1], before)
    run = np.repeat(np.arange(starts.size), sizes)
    at = np.flatnonzero(bad)
    share = (at - starts[run] + 0.5) / sizes[run]
    images = [2 * starts[run] - 1 - at, 2 * ends[run] - 1 - at]
    deviations = []
    for image, base, there in zip(images, (before, behind), count, strict=True):
        inside = (image >= 0) & (image < x.size) & (there[run] > 0)
        value = np.where(inside, x[image.clip(0, x.size - 1)], np.nan)
        deviations.append(value - base[run])
    weights = np.where(np.isnan(deviations), 0.0, np.sqrt([1.0 - share, share]))
    size = np.sqrt((weights**2).sum(axis=0))
    weights /= np.where(size > 0.0, size, 1.0)
    filled = before[run] + share * (behind - before)[run]
    filled += (weights * np.nan_to_num(deviations)).sum(axis=0)
    out = x.copy()
    out[at] = filled
    return out


def _redraw_short_runs(x: Array, seen: NDArray[np.bool_], starts: Places, sizes: Places) -> None:
    """Replace filled values of missing runs of up to 16 samples in `x`, in place, by random draws given their neighbors.

    `seen` is True for present samples. Runs within 24 samples of an end are unchanged.
    """
    inside = (
        (sizes <= MAX_DRAWN_RUN) & (starts >= NEIGHBORS) & (starts + sizes + NEIGHBORS <= x.size)
    )
    if not inside.any():
        return
    # The seed depends on the samples alone, so that the result does not depend on the chunks.
    noise = np.random.default_rng(zlib.crc32(x.tobytes()))
    middle = float(x[seen].mean())
    lags = _autocovariance(np.where(seen, x - middle, 0.0), seen, 2 * NEIGHBORS + MAX_DRAWN_RUN)
    laws = {size: _conditional_normal(lags, size) for size in np.unique(sizes[inside]).tolist()}
    for _ in range(SWEEPS):
        for size, (weights, root) in laws.items():
            first = starts[inside & (sizes == size)][:, None]
            expected = (x[first + _neighbor_offsets(size)] - middle) @ weights
            drawn = noise.standard_normal((first.size, size)) @ root.T
            x[first + np.arange(size)] = middle + expected + drawn


def _neighbor_offsets(size: int) -> Places:
    """Integer array, shape (48,): offsets, from the first sample of a run of `size`, of the 24 samples on each side."""
    return np.concatenate([np.arange(-NEIGHBORS, 0), np.arange(size, size + NEIGHBORS)])


def _conditional_normal(lags: Array, size: int) -> tuple[Array, Array]:
    """Tuple (weights, root) of the normal distribution of a run of `size` samples, given 24 neighbors on each side.

    The mean is neighbors @ weights, shape (48, size), and the covariance is root @ root.T. `lags` is the autocovariance.
    """
    neighbors, own = _neighbor_offsets(size), np.arange(size)
    among = lags[np.abs(neighbors[:, None] - neighbors)]
    among[np.diag_indices_from(among)] *= 1.0 + 1e-9
    across = lags[np.abs(neighbors[:, None] - own)]
    weights = np.linalg.lstsq(among, across, rcond=1e-10)[0]
    scale, turn = np.linalg.eigh(lags[np.abs(own[:, None] - own)] - across.T @ weights)
    return weights, turn * np.sqrt(np.maximum(scale, 0.0))


def _autocovariance(x: Array, seen: NDArray[np.bool_], lags: int) -> Array:
    """Autocovariance at lags 0 … `lags` − 1, shape (lags,), estimated as variance minus half the mean squared difference.

    Only pairs of present samples count; 0 at lags without pairs. `x` must be 0 where `seen` is False. For a random walk,
    this estimate is far more precise than the mean of products.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = next_fast_len(x.size + lags, real=True)
    of_x, of_square, of_seen = (rfft(part, n) for part in (x, x * x, seen.astype(np.float64)))
    pairs = np.round(irfft(np.abs(of_seen) ** 2, n)[:lags])
    # Squares of both samples of a pair, so that the result is the same forwards and backwards.
    squares = 2.0 * irfft((of_square * of_seen.conj()).real, n)[:lags]
    products = irfft(np.abs(of_x) ** 2, n)[:lags]
    steps = (squares - 2.0 * products) / np.maximum(pairs, 1.0)
    return np.asarray(np.where(pairs > 0.0, products[0] / pairs[0] - 0.5 * steps, 0.0))

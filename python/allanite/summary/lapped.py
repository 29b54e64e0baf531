"""Halving of the sampling rate, and a lapped orthogonal transform of overlapping segments.

The transform (Malvar 1990; Princen, Johnson & Bradley 1987) has a Kaiser-Bessel window. The coefficients of all transform
segments refer to an orthonormal basis of the record. The power of a band is therefore counted once with all its degrees
of freedom, and a line stays within a few coefficients.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array

#: Number of samples of a transform segment, and index of its lowest coefficient in use. Deeper levels of the pyramid
#: resolve lower frequencies better.
SEGMENT, LOW = 8192, 2457
#: Half length of the half-band filter: number of samples on each side from which a sample at half the rate is computed.
REACH = 16
#: Kaiser parameters of the half-band filter and of the window: below −100 dB in the stop band and far from a line.
FILTER_BETA, WINDOW_ALPHA = 10.06, 4.0


@lru_cache(maxsize=1)
def _half_band_weights() -> Array:
    """Half of the symmetric weights of the low-pass that halves the rate, shape (REACH,).

    Weight i belongs to the two samples that are i + ½ samples away from the middle between two samples.
    """
    at = np.arange(REACH) + 0.5
    taps = 0.5 * np.sinc(at / 2.0) * np.i0(FILTER_BETA * np.sqrt(1.0 - (at / REACH) ** 2))
    return np.asarray(0.5 * taps / taps.sum())


def low_pass_gain(f: Array, halvings: int) -> Array:
    """Amplitude response of the low-pass after `halvings` halvings; `f` is in cycles per sample of the first level."""
    out, at = np.ones_like(f), np.arange(REACH) + 0.5
    for level in range(halvings):
        w = 2.0 * np.pi * f * 2.0**level
        out *= 2.0 * np.cos(np.multiply.outer(w, at)) @ _half_band_weights()
    return out


@lru_cache(maxsize=1)
def kernel() -> _kernels.Lapped:
    """`Lapped` object of the compiled core, which halves and transforms samples. Cached: always the same object."""
    return _kernels.Lapped(*_window(), _half_band_weights())


def halved(x: Array) -> Array:
    """Samples of `x`, shape (n,), at half the rate after a low-pass, shape (n / 2 − 16,).

    Each one lies midway between two samples of `x`. The first and the last 8 are omitted, because the filter needs 16
    samples on each side. The order of the sums is fixed, so a value does not depend on the samples computed with it.
    """
    return kernel().halved(np.ascontiguousarray(x))


@lru_cache(maxsize=1)
def _window() -> tuple[Array, Array]:
    """Tuple (after, before): the rising slope of the transform window, around the border at which a segment begins.

    Both have shape (`SEGMENT`/2,), with values at ½, 1½, … samples from the border, `before` going backwards.
    """
    rise = np.cumsum(np.kaiser(SEGMENT + 1, np.pi * WINDOW_ALPHA))
    rise = np.sqrt(rise[:-1] / rise[-1])
    return rise[SEGMENT // 2 :], rise[: SEGMENT // 2][::-1].copy()


def _fold_at_border(zones: Array) -> tuple[Array, Array]:
    """Tuple (before, after): windowed and folded samples for the transform segments before and after a border.

    `zones` has `SEGMENT`/2 samples on each side of the border in the last axis. Both arrays begin at the border.
    """
    half = SEGMENT // 2
    after, before = _window()
    left, right = zones[..., half - 1 :: -1], zones[..., half:]
    return after * left - before * right, after * right + before * left


def segments(x: Array) -> Array:
    """Coefficients of the lapped transform of consecutive segments of `SEGMENT` samples, shape (segments, SEGMENT).

    `x` has `SEGMENT`/2 further samples before the first and after the last segment, because neighboring segments overlap.
    """
    return kernel().segments(np.ascontiguousarray(x)).reshape(-1, SEGMENT)


def transform_at_end(x: Array, left: bool, right: bool) -> Array:
    """Coefficients of the lapped transform of the first or the last segment of a record, or of a whole record.

    `left` and `right` are True if the record ends on this side; on the others, `x` has `SEGMENT`/2 samples more than the
    segment. The mean of `x` is subtracted first.
    """
    from scipy.fft import dct

    half = SEGMENT // 2
    # A mean larger than the noise would leak through the hard edge.
    x = x - x.mean()
    block = x[0 if left else half : x.size if right else x.size - half].copy()
    if not left:
        block[:half] = _fold_at_border(x[:SEGMENT])[1]
    if not right:
        block[block.size - half :] = _fold_at_border(x[x.size - SEGMENT :])[0][::-1]
    return np.asarray(dct(block, type=4, norm="ortho"))


def resample_power(power: Array) -> Array:
    """Array, shape (SEGMENT,): `power` of a transform segment of any length, interpolated with the same sum."""
    total = np.concatenate([[0.0], np.cumsum(power)])
    at = np.linspace(0.0, power.size, SEGMENT + 1)
    return np.diff(np.interp(at, np.arange(power.size + 1.0), total))

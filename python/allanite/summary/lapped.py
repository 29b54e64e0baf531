"""Halving of the rate, and the power of overlapping transform segments that share no information.

Segments are transformed by a lapped orthogonal transform (Malvar 1990; Princen, Johnson & Bradley 1987) with a
Kaiser-Bessel window. The coefficients of all segments are an orthonormal basis of the record. So the power of a band is
counted once with all its degrees of freedom, and a line stays within a few coefficients.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels

Array = NDArray[np.float64]
#: Samples of a segment, and its lowest coefficient that is used; the next level of the pyramid resolves lower ones better.
SEGMENT, LOW = 8192, 2457
#: Samples on each side that a halved sample is computed from.
REACH = 16
#: Kaiser parameters of the half-band filter and of the window: below −100 dB in the stop band and far from a line.
FILTER_BETA, WINDOW_ALPHA = 10.06, 4.0


@lru_cache(maxsize=1)
def _half_band_weights() -> Array:
    """Weights of the low-pass that halves the rate, shape (REACH,).

    The filter is symmetric about the middle between two samples. Weight i belongs to the two samples that are i + ½
    samples away from this middle.
    """
    at = np.arange(REACH) + 0.5
    taps = 0.5 * np.sinc(at / 2.0) * np.i0(FILTER_BETA * np.sqrt(1.0 - (at / REACH) ** 2))
    return np.asarray(0.5 * taps / taps.sum())


def low_pass_gain(f: Array, halvings: int) -> Array:
    """Amplitude response of the low-pass after `halvings` halvings of the rate, shape of `f`.

    The frequencies `f` are in cycles per sample of the first level.
    """
    out, at = np.ones_like(f), np.arange(REACH) + 0.5
    for level in range(halvings):
        w = 2.0 * np.pi * f * 2.0**level
        out *= 2.0 * np.cos(np.multiply.outer(w, at)) @ _half_band_weights()
    return out


@lru_cache(maxsize=1)
def kernel() -> _kernels.Lapped:
    """Object of the compiled core that halves and transforms samples; always the same object."""
    return _kernels.Lapped(*_window(), _half_band_weights())


def halved(x: Array) -> Array:
    """Samples at half the rate after a low-pass, shape (n / 2 − 16,); each lies in the middle between two samples.

    The first and the last `REACH`/2 values are omitted. Each sample is a sum in fixed order, so its value does not
    depend on the samples computed with it.
    """
    return kernel().halved(np.ascontiguousarray(x))


@lru_cache(maxsize=1)
def _window() -> tuple[Array, Array]:
    """(after, before): rising window at ½, 1½, … samples after the border of two segments, and before the border."""
    rise = np.cumsum(np.kaiser(SEGMENT + 1, np.pi * WINDOW_ALPHA))
    rise = np.sqrt(rise[:-1] / rise[-1])
    return rise[SEGMENT // 2 :], rise[: SEGMENT // 2][::-1].copy()


def _fold_at_border(zones: Array) -> tuple[Array, Array]:
    """(before, after): folded samples that contribute to the segment before the border and to the one after it.

    Both begin at the border and lead away from it. `zones` has `SEGMENT`/2 samples on each side of the border.
    """
    half = SEGMENT // 2
    after, before = _window()
    left, right = zones[..., half - 1 :: -1], zones[..., half:]
    return after * left - before * right, after * right + before * left


def segments(x: Array) -> Array:
    """Transform coefficients of consecutive segments, shape (segments, SEGMENT).

    In addition to these segments, `x` has half a segment at each end.
    """
    return kernel().segments(np.ascontiguousarray(x)).reshape(-1, SEGMENT)


def transform_at_end(x: Array, left: bool, right: bool) -> Array:
    """Transform coefficients of one segment that lies at the beginning or end of the record, or is the whole record.

    Parameters
    ----------
    x : ndarray
        The segment, with half of `SEGMENT` more on each side that has a neighbor.
    left, right : bool
        True if the record ends on this side.
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
    """Power of a segment of any length, interpolated to `SEGMENT` coefficients with the same sum."""
    total = np.concatenate([[0.0], np.cumsum(power)])
    at = np.linspace(0.0, power.size, SEGMENT + 1)
    return np.diff(np.interp(at, np.arange(power.size + 1.0), total))

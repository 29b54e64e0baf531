"""Computation of a deviation: averaging times, kernel, scale, bias and remarks."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.deviation.averaging import Samples, Taus, averaging_factors
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation.table import Estimator

#: Smallest variance without loss of digits: squares of samples stay far above 2.2e-308, the smallest normal double.
MIN_VARIANCE = 1e-270
#: Largest |log2| of samples whose squares a double holds.
MAX_EXPONENT = 400


def estimate(
    row: Estimator, src: Samples, taus: Taus, factors: ArrayLike | None, unbiased: bool = True
) -> Deviation:
    """`Deviation` of a record by one estimator, with the inputs of its intervals and its remarks.

    If `unbiased`, a published bias is divided out. Raises `InputError` for unusable averaging times, and
    `TooShortError` if none fits into the record.
    """
    points = src.points
    m, notes = averaging_factors(src, taus, factors, row.most(points))
    variance, n, alpha, gaps, step = kernel_results(row, src.samples, m, src.angle)
    tau = m / src.rate
    lost = row.max_terms(m, points) - n if gaps else np.zeros(n.size, np.int64)
    notes += gap_notes(gaps, src.samples.size, tau, n, lost)
    if row.bias is not None:
        variance, more = _corrected_variance(
            row.bias, row.name, variance, alpha, m, points, unbiased
        )
        notes += more
    scale = src.scale if row.gain is None else row.gain(src.scale, tau, src.rate)
    return Deviation(
        row.name,
        tau,
        m,
        n,
        np.sqrt(variance) * (step * scale),
        alpha,
        src.rate,
        src.unit,
        notes,
        partial(row.edf_at, alpha, m, n, points),
        lost=lost,
        _of_phase=row.gain is not None,
    )


def kernel_results(
    row: Estimator, samples: NDArray[Any], m: NDArray[np.int64], angle: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], int, float]:
    """Tuple (variance, counts, α, missing, scale) of an estimator at every averaging factor m.

    `counts` are the numbers of averaged squared differences, and `missing` is the number of missing samples. `scale` is
    1 unless squares of floating-point samples overflow or underflow. Then it is a power of two, and the variance is
    that of the samples divided by `scale`.
    """
    variance, n, alpha, gaps = row.kernel(samples, m, angle)
    # The usual case, quickly: a short record costs no more than its sums.
    if np.minimum.reduce(variance) > MIN_VARIANCE and np.maximum.reduce(variance) < np.inf:
        return variance, n, alpha, gaps, 1.0
    lost = (n > 0) & ~(np.isfinite(variance) & (variance > MIN_VARIANCE))
    if samples.dtype.kind != "f" or not lost.any():
        return variance, n, alpha, gaps, 1.0
    exponent = int(np.frexp(np.nanmax(np.abs(samples)))[1]) - 1
    if abs(exponent) < MAX_EXPONENT:  # no noise
        return variance, n, alpha, gaps, 1.0
    with np.errstate(invalid="ignore"):  # a NaN that signals is one like others
        scaled = np.ldexp(samples, -exponent)
    return *row.kernel(scaled, m, angle), 2.0**exponent


def _corrected_variance(
    published: Callable[[int, int, int], float],
    name: str,
    variance: NDArray[np.float64],
    alpha: NDArray[np.float64],
    m: NDArray[np.int64],
    points: int,
    unbiased: bool,
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Variance divided by the published bias of the estimator if `unbiased`, and at most one remark on the bias."""
    bias = np.array([published(int(a), int(f), points) for a, f in zip(alpha, m, strict=True)])
    if (bias == 1.0).all():
        return variance, ()
    if not unbiased:
        note = f"published bias of {name} left in: {bias.min():.3g} to {bias.max():.3g} in variance"
        return variance, (note,)
    note = f"published bias of {name} for the noise identified at each τ has been divided out"
    return variance / bias, (note,)

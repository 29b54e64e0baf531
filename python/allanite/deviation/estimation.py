"""From a record to a deviation: averaging times, the core, scale, bias, remarks."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.deviation.averaging import Samples, Taus, averaging
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation.table import Estimator

__all__ = ["estimate", "measured"]

#: Below, squares of the samples may have come near 2.2e-308, where doubles lose digits.
SMALLEST = 1e-270
#: Samples between 2^-EXTREME and 2^EXTREME have squares that a double holds.
EXTREME = 400


def estimate(
    row: Estimator, src: Samples, taus: Taus, factors: ArrayLike | None, unbiased: bool = True
) -> Deviation:
    """Deviation of a record by one estimator, with what its intervals and remarks are made of.

    Parameters
    ----------
    row : Estimator
        The estimator.
    src : Samples
        The record.
    taus, factors
        As of `allanite.oadev`.
    unbiased : bool
        Whether the published bias, if there is one, is divided out.

    Raises
    ------
    InputError
        Averaging times that cannot be used.
    TooShortError
        No averaging time that fits.
    """
    points = src.points
    m, notes = averaging(src, taus, factors, row.most(points))
    variance, n, alpha, gaps, step = measured(row, src.samples, m, src.angle)
    tau = m / src.rate
    lost = row.complete(m, points) - n if gaps else np.zeros(n.size, np.int64)
    if gaps:
        share = lost / np.maximum(n + lost, 1)
        notes = (*notes, *gap_notes(gaps, src.samples.size, tau, share))
    if row.bias is not None:
        variance, more = _corrected(row.bias, row.name, variance, alpha, m, points, unbiased)
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
        partial(row.freedom, alpha, m, n, points),
        lost=lost,
        _of_phase=row.gain is not None,
    )


def measured(
    row: Estimator, samples: NDArray[Any], m: NDArray[np.int64], angle: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], int, float]:
    """Variance, number of terms, power law at every factor, number of gaps, and the unit of their root.

    The unit is 1 but for samples whose squares a double does not hold: they are divided by a power of two first.
    """
    variance, n, alpha, gaps = row.kernel(samples, m, angle)
    # The usual case, quickly: a short record costs no more than its sums.
    if np.minimum.reduce(variance) > SMALLEST and np.maximum.reduce(variance) < np.inf:
        return variance, n, alpha, gaps, 1.0
    lost = (n > 0) & ~(np.isfinite(variance) & (variance > SMALLEST))
    if samples.dtype.kind != "f" or not lost.any():
        return variance, n, alpha, gaps, 1.0
    exponent = int(np.frexp(np.nanmax(np.abs(samples)))[1]) - 1
    if abs(exponent) < EXTREME:  # no noise
        return variance, n, alpha, gaps, 1.0
    with np.errstate(invalid="ignore"):  # a NaN that signals is one like others
        scaled = np.ldexp(samples, -exponent)
    return *row.kernel(scaled, m, angle), 2.0**exponent


def _corrected(
    published: Callable[[int, int, int], float],
    name: str,
    variance: NDArray[np.float64],
    alpha: NDArray[np.float64],
    m: NDArray[np.int64],
    points: int,
    unbiased: bool,
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Variance with or without the published bias, and a word about it."""
    bias = np.array([published(int(a), int(f), points) for a, f in zip(alpha, m, strict=True)])
    if (bias == 1.0).all():
        return variance, ()
    if not unbiased:
        note = f"published bias of {name} left in: {bias.min():.3g} to {bias.max():.3g} in variance"
        return variance, (note,)
    note = f"published bias of {name} for the noise identified at each τ has been divided out"
    return variance / bias, (note,)

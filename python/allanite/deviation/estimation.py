"""From a record to a deviation: averaging times, the core, scale, bias, remarks."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from allanite.deviation.averaging import Samples, Taus, averaging
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation.table import Estimator

__all__ = ["estimate"]


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
    m, notes = averaging(src, taus, factors, row.most(src.points))
    variance, n, alpha, gaps = row.kernel(src.samples, m, src.angle)
    tau = m / src.rate
    lost = row.complete(m, src.points) - n if gaps else np.zeros(n.size, np.int64)
    if gaps:
        share = lost / np.maximum(n + lost, 1)
        notes = (*notes, *gap_notes(gaps, src.samples.size, tau, share))
    variance, more = _corrected(row, variance, alpha, m, src.points, unbiased)
    scale = src.scale if row.gain is None else row.gain(src.scale, tau, src.rate)
    return Deviation(
        row.name,
        tau,
        m,
        n,
        np.sqrt(variance) * scale,
        alpha,
        src.rate,
        src.unit,
        notes + more,
        partial(row.freedom, alpha, m, n, src.points),
        lost=lost,
        _of_phase=row.gain is not None,
    )


def _corrected(
    row: Estimator,
    variance: NDArray[np.float64],
    alpha: NDArray[np.float64],
    m: NDArray[np.int64],
    points: int,
    unbiased: bool,
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Variance with or without the published bias, and a word about it."""
    if row.bias is None:
        return variance, ()
    bias = np.array([row.bias(int(a), int(f), points) for a, f in zip(alpha, m, strict=True)])
    if (bias == 1.0).all():
        return variance, ()
    if not unbiased:
        note = f"published bias of {row.name} left in: {bias.min():.3g} to {bias.max():.3g} in variance"
        return variance, (note,)
    note = f"published bias of {row.name} for the noise identified at each τ has been divided out"
    return variance / bias, (note,)

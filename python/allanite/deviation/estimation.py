"""From a record to a deviation: averaging times, the core, scale, bias, remarks."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.deviation.averaging import Source, averaging
from allanite.deviation.bias import corrected, freedom
from allanite.deviation.gaps import complete, said
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation.functions import Taus

__all__ = ["estimate"]

#: Largest averaging factor of L phase points.
_MOST = {
    "oadev": lambda points: (points - 1) // 2,
    "adev": lambda points: (points - 1) // 2,
    "pdev": lambda points: (points - 1) // 2,
    "ohdev": lambda points: (points - 1) // 3,
    "hdev": lambda points: (points - 1) // 3,
    "htotdev": lambda points: (points - 1) // 3,
    "mdev": lambda points: points // 3,
    "mtotdev": lambda points: points // 3,
    "totdev": lambda points: points - 1,
    "tierms": lambda points: points - 1,
    "mtie": lambda points: points - 1,
}
#: Time deviations, and the modified ones that they are τ/√3 times.
_TIMES = {"tdev": "mdev", "ttotdev": "mtotdev"}


def estimate(
    kind: str, src: Source, taus: Taus, factors: ArrayLike | None, unbiased: bool = True
) -> Deviation:
    """The deviation `kind` of a record, with what its intervals and remarks are made of.

    Parameters
    ----------
    kind : str
        Name of the estimator in `allanite.deviation`.
    src : Source
        The record.
    taus, factors
        As of `allanite.oadev`.
    unbiased : bool
        Whether the published bias of the total estimators is divided out.

    Raises
    ------
    InputError
        Averaging times that cannot be used.
    TooShortError
        No averaging time that fits.
    """
    core = _TIMES.get(kind, kind)
    m, notes = averaging(src, taus, factors, _MOST[core](src.points))
    if core in ("oadev", "adev"):
        compute = _kernels.overlapping_allan if core == "oadev" else _kernels.adjacent_allan
        variance, n, alpha, gaps = compute(src.samples, m, src.angle)
        if src.angle:
            variance = variance / m**2
    else:
        variance, n, alpha, gaps = _kernels.family_variance(core, src.samples, m, src.angle)
    tau = m / src.rate
    lost = complete(core, m, src.points) - n if gaps else np.zeros(n.size, np.int64)
    if gaps:
        share = lost / np.maximum(n + lost, 1)
        notes = (*notes, *said(gaps, src.samples.size, tau, share))
    variance, more = corrected(core, variance, alpha, m, src.points, unbiased)
    scale: float | NDArray[np.float64] = src.scale
    if core in ("tierms", "mtie"):
        scale = src.scale / src.rate
    elif core != kind:
        scale = src.scale * tau / np.sqrt(3.0)
    return Deviation(
        kind,
        tau,
        m,
        n,
        np.sqrt(variance) * scale,
        alpha,
        src.rate,
        src.unit,
        notes + more,
        partial(freedom, core, alpha, m, n, src.points),
        lost=lost,
    )

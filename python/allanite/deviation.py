"""Allan deviation and its relatives of a record."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from allanite import _kernels
from allanite.averaging import Source, averaging, source
from allanite.deviation_result import Deviation
from allanite.gaps import complete, said
from allanite.total import corrected, freedom

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    Taus: TypeAlias = str | int | Sequence[float] | NDArray[np.float64]

__all__ = [
    "Deviation",
    "adev",
    "hdev",
    "htotdev",
    "mdev",
    "mtie",
    "mtotdev",
    "oadev",
    "ohdev",
    "pdev",
    "tdev",
    "tierms",
    "totdev",
    "ttotdev",
]


def oadev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Overlapping Allan deviation: NIST SP 1065 eq. 11.

    σ²(m τ0) = 1/(2 τ² M) Σ_k (θ[k+2m] − 2 θ[k+m] + θ[k])², all M = L − 2m of them. NaN samples cost
    only the terms that touch them. Integers are used exactly.

    Parameters
    ----------
    x : array_like of shape (n,) or Recording
        Samples; a recording brings its own rate, unit and quantity.
    rate : float
        Sampling rate, Hz.
    taus : {"octave", "decade", "all"} or int or sequence of float
        Averaging times: 1, 2, 4, 8, …; 1, 2, 4, 10, 20, 40, …; every one; so many per decade; or
        in seconds (rounded to multiples of the sampling interval).
    factors : array_like of int, optional
        Averaging factors instead of `taus`.
    quantity : {"rate", "increment", "angle"}
        What the samples are: the rate, its integral over one sample, or from the start (the phase
        of a clock).

    Returns
    -------
    Deviation
        With 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        Samples, rate, taus or quantity that cannot be used.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return _estimate("oadev", source(x, rate, quantity), taus, factors)


def adev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Allan deviation of adjacent averages, not overlapping: NIST SP 1065 eq. 9; parameters as of `oadev`."""
    return _estimate("adev", source(x, rate, quantity), taus, factors)


def ohdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Overlapping Hadamard deviation, blind to a drift of the rate: NIST SP 1065 eq. 20; parameters as of `oadev`."""
    return _estimate("ohdev", source(x, rate, quantity), taus, factors)


def hdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Hadamard deviation of adjacent averages, not overlapping: NIST SP 1065 eq. 18; parameters as of `oadev`."""
    return _estimate("hdev", source(x, rate, quantity), taus, factors)


def mdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Modified Allan deviation, which tells white from flicker phase noise: NIST SP 1065 eq. 14.

    Parameters as of `oadev`.
    """
    return _estimate("mdev", source(x, rate, quantity), taus, factors)


def tdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Time deviation, τ/√3 times the modified Allan deviation: NIST SP 1065 eq. 16; parameters as of `oadev`."""
    return _estimate("tdev", source(x, rate, quantity), taus, factors)


def pdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Parabolic deviation, of slopes fitted to the phase: Vernotte et al. 2016 eq. 9.

    The interval uses the degrees of freedom of `mdev`, which are fewer. Parameters as of `oadev`.
    """
    return _estimate("pdev", source(x, rate, quantity), taus, factors)


def totdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
    unbiased: bool = True,
) -> Deviation:
    """Total deviation, of the record reflected at its ends: NIST SP 1065 eq. 25.

    `unbiased` divides by the published bias of flicker and random-walk FM, 1 − a τ/T up to half of the record.
    Other parameters as of `oadev`.
    """
    return _estimate("totdev", source(x, rate, quantity), taus, factors, unbiased)


def mtotdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
    unbiased: bool = False,
) -> Deviation:
    """Modified total deviation: NIST SP 1065 eq. 27.

    `unbiased` divides by the published bias (0.73 of white FM in variance), which Stable32 1.60 leaves in, as is
    done by default. O(n). Other parameters as of `oadev`.
    """
    return _estimate("mtotdev", source(x, rate, quantity), taus, factors, unbiased)


def ttotdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
    unbiased: bool = False,
) -> Deviation:
    """Time total deviation, τ/√3 times the modified total deviation: NIST SP 1065 eq. 28; parameters as of `mtotdev`."""
    return _estimate("ttotdev", source(x, rate, quantity), taus, factors, unbiased)


def htotdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
    unbiased: bool = True,
) -> Deviation:
    """Hadamard total deviation; at m = 1 the overlapping Hadamard deviation: NIST SP 1065 eq. 29.

    `unbiased` divides by the published bias at m > 1 (0.995 of white FM in variance). O(n). Other parameters
    as of `oadev`.
    """
    return _estimate("htotdev", source(x, rate, quantity), taus, factors, unbiased)


def tierms(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Root mean square of the time interval error: ITU-T G.810.

    What the phase gains in τ beyond the mean rate; in U·s for rates in U. No interval is known. Parameters as of `oadev`.
    """
    return _estimate("tierms", source(x, rate, quantity), taus, factors)


def mtie(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Largest time interval error within τ: ITU-T G.810.

    In U·s for rates in U. No interval is known. Parameters as of `oadev`.
    """
    return _estimate("mtie", source(x, rate, quantity), taus, factors)


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


def _estimate(
    kind: str, src: Source, taus: Taus, factors: ArrayLike | None, unbiased: bool = True
) -> Deviation:
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

"""Allan deviation and its relatives of a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from allanite.deviation.averaging import source
from allanite.deviation.estimation import estimate
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
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
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        Samples, rate, taus or quantity that cannot be used.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("oadev", source(x, rate, quantity), taus, factors)


def adev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Allan deviation of adjacent averages, not overlapping: NIST SP 1065 eq. 9.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("adev", source(x, rate, quantity), taus, factors)


def ohdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Overlapping Hadamard deviation, blind to a drift of the rate: NIST SP 1065 eq. 20.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("ohdev", source(x, rate, quantity), taus, factors)


def hdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Hadamard deviation of adjacent averages, not overlapping: NIST SP 1065 eq. 18.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("hdev", source(x, rate, quantity), taus, factors)


def mdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Modified Allan deviation, which tells white from flicker phase noise: NIST SP 1065 eq. 14.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("mdev", source(x, rate, quantity), taus, factors)


def tdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Time deviation, τ/√3 times the modified Allan deviation: NIST SP 1065 eq. 16.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate times s (deg of deg/s, s of a frequency);
        95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("tdev", source(x, rate, quantity), taus, factors)


def pdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Parabolic deviation, of slopes fitted to the phase: Vernotte et al. 2016 eq. 9.

    The interval uses the degrees of freedom of `mdev`, which are fewer. Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("pdev", source(x, rate, quantity), taus, factors)


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

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("totdev", source(x, rate, quantity), taus, factors, unbiased)


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

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("mtotdev", source(x, rate, quantity), taus, factors, unbiased)


def ttotdev(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
    unbiased: bool = False,
) -> Deviation:
    """Time total deviation, τ/√3 times the modified total deviation: NIST SP 1065 eq. 28.

    Parameters as of `mtotdev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate times s (deg of deg/s, s of a frequency);
        95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("ttotdev", source(x, rate, quantity), taus, factors, unbiased)


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

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("htotdev", source(x, rate, quantity), taus, factors, unbiased)


def tierms(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Root mean square of the time interval error: ITU-T G.810.

    What the phase gains in τ beyond the mean rate. Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate times s (deg of deg/s, s of a frequency); no interval is known.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("tierms", source(x, rate, quantity), taus, factors)


def mtie(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Largest time interval error within τ: ITU-T G.810.

    Parameters as of `oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate times s (deg of deg/s, s of a frequency); no interval is known.

    Raises
    ------
    InputError
        As of `oadev`.
    TooShortError
        Fewer than 3 samples, or no averaging time that fits.
    """
    return estimate("mtie", source(x, rate, quantity), taus, factors)

"""Allan deviation and its relatives of a record."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.errors import InputError, TooShortError
from allanite.identification import carried, degrees_of_freedom, interval

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = ["Deviation", "adev", "oadev"]

QUANTITIES = ("rate", "increment", "angle")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Deviation:
    """A deviation over averaging times.

    Attributes
    ----------
    kind : str
        Name of the estimator, e.g. ``oadev``.
    tau : ndarray of shape (k,)
        Averaging times, s.
    factors : ndarray of shape (k,)
        Averaging factors m; τ = m / rate.
    n : ndarray of shape (k,)
        Number of terms that were averaged.
    deviation : ndarray of shape (k,)
        The estimates, in `unit`.
    alpha : ndarray of shape (k,)
        Exponent of the noise S_y ∝ f^α identified at each τ; it sets `edf`.
    rate : float
        Sampling rate, Hz.
    unit : str
        Unit of the deviation.
    diagnostics : tuple of str
        What to know before trusting it.
    """

    kind: str
    tau: NDArray[np.float64]
    factors: NDArray[np.int64]
    n: NDArray[np.int64]
    deviation: NDArray[np.float64]
    alpha: NDArray[np.float64]
    rate: float
    unit: str = "1"
    diagnostics: tuple[str, ...] = ()
    _freedom: Callable[[], NDArray[np.float64]] | None = None
    _bands: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("tau", "factors", "n", "deviation", "alpha"):
            getattr(self, name).flags.writeable = False

    @property
    def edf(self) -> NDArray[np.float64]:
        """Equivalent degrees of freedom, shape (k,); NaN where there is no estimate."""
        return self._band("edf")

    @property
    def low(self) -> NDArray[np.float64]:
        """Lower end of the 95 % interval, shape (k,)."""
        return self._band("low")

    @property
    def high(self) -> NDArray[np.float64]:
        """Upper end of the 95 % interval, shape (k,)."""
        return self._band("high")

    def _band(self, name: str) -> NDArray[np.float64]:
        # Made when first asked for: it takes longer than the deviation of a short record.
        if not self._bands:
            edf = np.full(self.tau.shape, np.nan) if self._freedom is None else self._freedom()
            low, high = interval(self.deviation, edf)
            for key, values in (("low", low), ("high", high), ("edf", edf)):
                values.flags.writeable = False
                self._bands[key] = values
        return self._bands[name]

    def __len__(self) -> int:
        return self.tau.size

    def to_dict(self) -> dict[str, Any]:
        """JSON form: `kind` and `points`; null for what is not known."""
        columns = (self.deviation, self.low, self.high, self.edf)
        names = ("deviation", "low", "high", "edf")
        points = []
        for tau, m, n, *values in zip(self.tau, self.factors, self.n, *columns, strict=True):
            point: dict[str, Any] = {"tau_s": float(tau), "m": int(m), "n": int(n)}
            for name, value in zip(names, values, strict=True):
                point[name] = float(value) if np.isfinite(value) else None
            points.append(point)
        return {"kind": self.kind, "points": points, "diagnostics": list(self.diagnostics)}

    def __str__(self) -> str:
        head = f"{'tau (s)':>12} {'m':>10} {'n':>11} {self.kind:>12} {'low':>12} {'high':>12} {'edf':>9}"
        rows = [
            f"{t:12.6g} {m:10d} {n:11d} {d:12.5e} {low:12.5e} {high:12.5e} {e:9.4g}"
            for t, m, n, d, low, high, e in self._rows()
        ]
        title = f"{self.kind} ({self.unit}), 95 % interval"
        return "\n".join([title, head, *rows, *self.diagnostics])

    def __repr__(self) -> str:
        if not len(self):
            return f"Deviation({self.kind}: empty)"
        return (
            f"Deviation({self.kind}: {len(self)} averaging times from {self.tau[0]:g} s to "
            f"{self.tau[-1]:g} s in {self.unit})"
        )

    def _repr_html_(self) -> str:
        head = "".join(
            f"<th>{name}</th>" for name in ("τ (s)", "m", "n", self.kind, "low", "high", "edf")
        )
        rows = "".join(
            "<tr>" + "".join(f"<td>{value:.6g}</td>" for value in row) + "</tr>"
            for row in self._rows()
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"

    def _rows(self) -> zip[tuple[Any, ...]]:
        return zip(
            self.tau,
            self.factors,
            self.n,
            self.deviation,
            self.low,
            self.high,
            self.edf,
            strict=True,
        )


@dataclass(frozen=True, slots=True)
class Source:
    """Samples of one column, ready for the core."""

    samples: NDArray[Any]
    rate: float
    angle: bool
    scale: float
    unit: str


def source(x: Any, rate: float, quantity: str) -> Source:
    """Take whatever was given as one column of native numbers, without a copy where possible."""
    unit = "1"
    if hasattr(x, "samples") and hasattr(x, "quantity"):  # a recording
        rate, quantity, unit = x.rate, x.quantity, x.unit
        x = x.samples
    if quantity not in QUANTITIES:
        raise InputError(f"unknown quantity {quantity!r}: one of {', '.join(QUANTITIES)}")
    try:
        rate = float(rate)
    except (TypeError, ValueError):
        raise InputError(f"the rate must be a number of Hz, found {rate!r}") from None
    if not (rate > 0 and rate < np.inf):
        raise InputError(f"the rate must be a positive number of Hz, found {rate:g}")
    array = x if type(x) is np.ndarray else _array(x)
    if array.ndim != 1:
        raise InputError(
            f"one column of samples is needed, found shape {array.shape}: choose a column"
        )
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind not in "iuf":
        raise InputError(f"samples must be real numbers, found {array.dtype}")
    if array.size < 3:
        raise TooShortError(f"{array.size} samples: at least 3 are needed")
    if not array.dtype.isnative or (kind == "f" and size not in (4, 8)):
        array = array.astype(np.float64 if kind == "f" else array.dtype.newbyteorder("="))
    if not array.flags.aligned or array.strides[0] % array.itemsize or array.strides[0] == 0:
        array = np.ascontiguousarray(array)
    scale = rate if quantity != "rate" else 1.0
    return Source(array, rate, quantity == "angle", scale, unit)


def _array(x: ArrayLike) -> NDArray[Any]:
    if isinstance(x, np.ma.MaskedArray):
        return x.astype(np.float64).filled(np.nan)
    array = np.asarray(x)
    if array.dtype.kind == "b":
        return array.astype(np.int8)
    if array.dtype.kind == "O":
        try:
            return array.astype(np.float64)
        except (TypeError, ValueError):
            return array
    return array


def averaging(
    source: Source,
    taus: str | int | ArrayLike,
    factors: ArrayLike | None,
    most: int,
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Averaging factors asked for, rising, and what had to be changed."""
    if factors is None and isinstance(taus, str):
        if taus not in ("octave", "decade", "all"):
            raise InputError(
                f"unknown taus {taus!r}: octave, decade, all, a number per decade, or seconds"
            )
        return _kernels.averaging_factors(taus, 0, most), ()
    if factors is None and isinstance(taus, (int, np.integer)) and not isinstance(taus, bool):
        if not 0 < taus < 2**31:
            raise InputError(f"{taus} averaging times per decade: give at least 1")
        return _kernels.averaging_factors("", int(taus), most), ()
    notes = []
    try:
        wanted = np.atleast_1d(np.asarray(taus if factors is None else factors, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"taus must be seconds, found {taus!r}") from None
    if wanted.ndim != 1 or wanted.size == 0 or not np.isfinite(wanted).all():
        raise InputError("averaging times must be a list of finite numbers")
    exact = wanted * source.rate if factors is None else wanted
    if factors is not None and (exact != np.round(exact)).any():
        raise InputError(f"averaging factors must be whole numbers, found {exact.tolist()[:5]}")
    found = np.unique(np.maximum(np.round(exact), 0.0)).astype(np.int64)
    moved = np.abs(np.round(exact) - exact) > 1e-6 * np.maximum(exact, 1.0)
    if moved.any():
        notes.append(
            f"{np.count_nonzero(moved)} averaging times were rounded to multiples of"
            f" {1 / source.rate:g} s"
        )
    if found.size < wanted.size:
        notes.append(f"{wanted.size - found.size} averaging times fell together")
    outside = (found < 1) | (found > most)
    if outside.any():
        gone = found[outside]
        if outside.all():
            raise TooShortError(
                f"no averaging time between {1 / source.rate:g} s and {most / source.rate:g} s,"
                f" which is all that {source.samples.size} samples hold"
            )
        notes.append(
            f"{gone.size} averaging times outside of {1 / source.rate:g} s to"
            f" {most / source.rate:g} s were left out"
        )
    return found[~outside], tuple(notes)


def oadev(
    x: ArrayLike | Any,
    rate: float = 1.0,
    taus: str | int | Sequence[float] | NDArray[np.float64] = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Overlapping Allan deviation.

    σ²(m τ0) = 1/(2 τ² M) Σ_k (θ[k+2m] − 2 θ[k+m] + θ[k])², all M = L − 2m of them: NIST SP 1065 eq. 11.
    NaN samples cost only the terms that touch them. Integers are used exactly.

    Parameters
    ----------
    x : array_like of shape (n,) or Recording
        Samples; a recording brings its own rate, unit and quantity.
    rate : float
        Sampling rate, Hz.
    taus : {"octave", "decade", "all"} or int or sequence of float
        Averaging times: 1, 2, 4, 8, …; 1, 2, 4, 10, 20, 40, …; every one; so many per decade; or in seconds
        (rounded to multiples of the sampling interval).
    factors : array_like of int, optional
        Averaging factors instead of `taus`.
    quantity : {"rate", "increment", "angle"}
        What the samples are: the rate, its integral over one sample, or from the start (a clock's phase).

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
    src = source(x, rate, quantity)
    points = src.samples.size + (not src.angle)
    m, notes = averaging(src, taus, factors, (points - 1) // 2)
    variance, n, alpha, gaps = _kernels.overlapping_allan(src.samples, m, src.angle)
    return _result(
        "oadev", src, m, n, variance / m**2 if src.angle else variance, alpha, gaps, notes
    )


def adev(
    x: ArrayLike | Any,
    rate: float = 1.0,
    taus: str | int | Sequence[float] | NDArray[np.float64] = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Allan deviation of adjacent averages, not overlapping: NIST SP 1065 eq. 9; parameters as `oadev`."""
    src = source(x, rate, quantity)
    points = src.samples.size + (not src.angle)
    m, notes = averaging(src, taus, factors, (points - 1) // 2)
    variance, n, alpha, gaps = _kernels.adjacent_allan(src.samples, m, src.angle)
    return _result(
        "adev", src, m, n, variance / m**2 if src.angle else variance, alpha, gaps, notes
    )


def _result(
    kind: str,
    src: Source,
    m: NDArray[np.int64],
    n: NDArray[np.int64],
    variance: NDArray[np.float64],
    alpha: NDArray[np.float64],
    gaps: int,
    notes: tuple[str, ...],
) -> Deviation:
    if gaps:
        notes = (*notes, f"{gaps} of {src.samples.size} samples are missing")
    alpha = carried(alpha)
    freedom = partial(_freedom, kind, alpha, m, n)
    return Deviation(
        kind,
        m / src.rate,
        m,
        n,
        np.sqrt(variance) * src.scale,
        alpha,
        src.rate,
        src.unit,
        notes,
        freedom,
    )


def _freedom(
    kind: str, alpha: NDArray[np.float64], m: NDArray[np.int64], n: NDArray[np.int64]
) -> NDArray[np.float64]:
    adjacent = kind == "adev"
    return np.array(
        [
            degrees_of_freedom(a, int(f), int(c), stride=int(f) if adjacent else 1) if c else np.nan
            for a, f, c in zip(alpha, m, n, strict=True)
        ]
    )

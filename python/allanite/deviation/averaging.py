"""Arguments of all estimators: one column of samples, a rate and averaging times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError, TooShortError
from allanite.common.validation import positive_rate, require_one_column, require_quantity
from allanite.recording.samples import stamps_of_index

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

#: Averaging times as a keyword, a number per decade, or seconds.
Taus: TypeAlias = "str | int | Sequence[float] | NDArray[np.float64]"


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one column with rate, quantity and unit, ready for the compiled kernels."""

    samples: NDArray[Any]
    rate: float
    quantity: str
    unit: str

    @property
    def angle(self) -> bool:
        """True if the samples are the integral of the rate from the start: an angle, or the phase of a clock."""
        return self.quantity == "angle"

    @property
    def scale(self) -> float:
        """Factor that converts a deviation of the samples to the unit of the rate.

        The factor is 1 for rates, and the sampling rate for increments and angles.
        """
        return 1.0 if self.quantity == "rate" else self.rate

    @property
    def points(self) -> int:
        """Number of phase points: the number of samples, plus 1 if they are rates or increments."""
        return self.samples.size + (not self.angle)


def samples_of(x: object, rate: float, quantity: str) -> Samples:
    """`Samples` of an array, recording, pandas or xarray object; a recording overrides `rate` and `quantity`.

    A time index of pandas or xarray gives rate and gaps, if `rate` is 1. Raises `TooShortError` for fewer than 3
    samples.
    """
    unit = "1"
    if stamps_of_index(x) is not None:  # pandas or xarray with its own time: gaps and rate by it
        from allanite.recording import Recording

        x = Recording(x, None if rate == 1.0 else rate, quantity=quantity)  # type: ignore[arg-type]
    if hasattr(x, "stretches"):
        raise InputError(
            "a summary keeps only the overlapping Allan deviation: call summary.column(0).oadev(), or read the log for"
            " other deviations"
        )
    if hasattr(x, "samples") and hasattr(x, "quantity"):  # a recording
        log: Any = x
        if hasattr(log, "columns"):
            require_one_column(log, "al.deviations(recording, kind)")
        rate, quantity, unit = log.rate, log.quantity, log.unit
        x = log.samples
    require_quantity(quantity)
    rate = positive_rate(rate)
    array = one_column(x)
    if array.size < 3:
        raise TooShortError(f"{array.size} samples: at least 3 are needed")
    if not array.flags.aligned or array.strides[0] % array.itemsize or array.strides[0] == 0:
        array = np.ascontiguousarray(array)
    return Samples(array, rate, quantity, unit)


def one_column(x: object) -> NDArray[Any]:
    """Samples as an array of native integers, float32 or float64, shape (n,). Masked samples become NaN, booleans int8.

    Raises `InputError` for other shapes and other types.
    """
    array = x if type(x) is np.ndarray else _array_of_object(x)
    if array.ndim != 1:
        raise InputError(
            f"one column of samples is needed, found shape {array.shape}: choose a column"
        )
    if array.dtype.kind == "b":
        array = array.astype(np.int8)
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind not in "iuf":
        raise InputError(f"samples must be real numbers, found {array.dtype}")
    if not array.dtype.isnative or (kind == "f" and size not in (4, 8)):
        narrow = kind == "f" and size not in (4, 8)
        return array.astype(np.float64 if narrow else array.dtype.newbyteorder("="))
    return array


def _array_of_object(x: Any) -> NDArray[Any]:
    """`np.asarray(x)`, but float64 for masked arrays, for Python numbers (None becomes NaN) and for empty arrays.

    Masked samples are NaN. Python objects that NumPy does not convert to float64 stay an array of dtype object.
    """
    if isinstance(x, np.ma.MaskedArray):
        return np.ma.filled(x.astype(np.float64), np.nan)
    array = np.asarray(x)
    if array.dtype.kind == "O" or array.size == 0:
        try:
            return array.astype(np.float64)
        except (TypeError, ValueError, OverflowError):
            return array
    return array


def averaging_factors(
    src: Samples, taus: str | int | ArrayLike, factors: ArrayLike | None, most: int
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Ascending averaging factors from 1 to `most` that `taus` or `factors` request, and remarks on those changed.

    The remarks state what was rounded or omitted. Raises `TooShortError` if no factor is left, and `InputError` for
    unusable values.
    """
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
    found, notes = _explicit_factors(src, taus if factors is None else factors, factors is None)
    if found[0] >= 1 and found[-1] <= most:
        return found, notes
    outside = (found < 1) | (found > most)
    span = f"{1 / src.rate:g} s to {most / src.rate:g} s"
    if outside.all():
        raise TooShortError(
            f"no averaging time within {span}, which is all that {src.samples.size} samples hold"
        )
    left_out = f"{np.count_nonzero(outside)} averaging times outside of {span} were not used"
    return found[~outside], (*notes, left_out)


def _explicit_factors(
    src: Samples, values: ArrayLike, seconds: bool
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Ascending, unique averaging factors, from given factors or from times (s) if `seconds`, and remarks on rounding.

    Raises `InputError` for unusable values, such as fractional factors.
    """
    try:
        wanted = np.atleast_1d(np.asarray(values))
        whole = not seconds and wanted.dtype.kind == "i" and wanted.ndim == 1 and wanted.size > 0
        if whole and not np.count_nonzero(wanted[1:] <= wanted[:-1]):  # the usual case, quickly
            return wanted.astype(np.int64), ()
        wanted = wanted.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"averaging times must be numbers, found {values!r}") from None
    if wanted.ndim != 1 or wanted.size == 0 or not np.isfinite(wanted).all():
        raise InputError("averaging times must be a list of finite numbers")
    exact = wanted * src.rate if seconds else wanted
    near = np.round(exact)
    moved = np.abs(near - exact) > 1e-6 * np.maximum(exact, 1.0)
    notes = []
    if moved.any():
        if not seconds:
            raise InputError(f"averaging factors must be whole numbers, found {exact[moved][0]:g}")
        notes.append(
            f"{np.count_nonzero(moved)} averaging times were rounded to multiples of"
            f" {1 / src.rate:g} s"
        )
    found = np.unique(np.clip(near, 0.0, 2.0**62)).astype(np.int64)
    if found.size < wanted.size:
        notes.append(
            f"{wanted.size - found.size} averaging times were equal to others after rounding"
        )
    return found, tuple(notes)

"""Check arguments; each function returns the checked value or raises an `InputError`."""

from __future__ import annotations

import math
import operator
from os import PathLike, fspath

import numpy as np

from allanite.common.arrays import Array
from allanite.common.choices import QUANTITIES
from allanite.common.errors import InputError

#: Largest seed: the generator takes 64 bits.
SEEDS = 2**64 - 1
#: Largest number whose square is still a double.
MAX_NUMBER = 1e150
#: Allowed range of the largest deviation of a sample from the mean. Squares of powers are fourth powers of samples, which
#: must be doubles: 1e-300 to 1e300.
DEVIATION_RANGE = (1e-75, 1e75)
#: Largest rate, Hz, and reciprocal of the smallest. Products of powers of rates and coefficients must be doubles.
MAX_RATE = 1e30


def positive(value: object, name: str, unit: str, remedy: str) -> float:
    """Value as a float; raises `InputError` with `remedy` unless it is positive and at most 1e150."""
    number = _number(value)
    if not 0.0 < number <= MAX_NUMBER:
        shown = f"{number:g}" if isinstance(value, (int, float)) else repr(value)
        raise InputError(f"{name} = {shown}{f' {unit}' if unit else ''}: {remedy}")
    return number


def positive_rate(rate: object) -> float:
    """Sampling rate in Hz as a float; raises `InputError` unless it is a number from 1e-30 to 1e30."""
    number = _number(rate)
    if math.isnan(number) and not isinstance(rate, float):
        raise InputError(f"the rate must be a number in Hz, found {rate!r}")
    if not 0.0 < number < math.inf:
        raise InputError(f"the rate must be a positive number of Hz, found {number:g}")
    if not 1.0 / MAX_RATE <= number <= MAX_RATE:
        raise InputError(
            f"the rate must be from {1 / MAX_RATE:g} to {MAX_RATE:g} Hz, found {number:g}"
        )
    return number


def require_quantity(quantity: object) -> None:
    """Raise `InputError` unless the quantity is ``"rate"``, ``"increment"`` or ``"angle"``."""
    if quantity not in QUANTITIES:
        raise InputError(f"unknown quantity {quantity!r}: one of {', '.join(QUANTITIES)}")


def require_recording(given: object) -> None:
    """Raise `InputError` unless the argument has `columns` and `rate`, as a recording or a summary."""
    if hasattr(given, "columns") and hasattr(given, "rate"):
        return
    if isinstance(given, (str, PathLike)):
        path = fspath(given)
        raise InputError(f"{path!r} is a path, not a recording: use al.read({path!r})")
    what = "an array" if hasattr(given, "__array__") or isinstance(given, (list, tuple)) else ""
    raise InputError(
        f"{what or type(given).__name__} is not a recording:"
        " use al.Recording(x, rate=…, unit=…) or al.read(path)"
    )


def require_one_column(given: object, for_several: str) -> None:
    """Raise `InputError` unless the argument is a recording or summary of one column; `for_several` is what takes more."""
    require_recording(given)
    if (count := len(given.columns)) > 1:  # type: ignore[attr-defined]
        raise InputError(
            f"a recording of {count} columns: use {for_several}, or choose one with recording[name]"
        )


def floats(values: object, name: str) -> Array:
    """Values as a float64 array of the same shape; booleans become 0 and 1. Raises `InputError` for other values."""
    try:
        given = np.asarray(values)
        if given.dtype.kind in "biufO":
            return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{name} must be numbers, found {str(values)[:40]!r}")


def require_frequencies(values: object, name: str, unit: str) -> Array:
    """Frequencies or times (in `unit`) as a float64 array; raises `InputError` unless all are from 1e-60 to 1e60."""
    numbers = floats(values, name)
    low, high = MAX_RATE**-2, MAX_RATE**2
    wrong = numbers[~((numbers >= low) & (numbers <= high))]
    if wrong.size:
        raise InputError(f"{name} must be from {low:g} to {high:g} {unit}, found {wrong.flat[0]:g}")
    return numbers


def check_size(samples: Array, label: str, of: str) -> None:
    """Raise `InputError` for samples whose fourth powers are too large or too small for a double, unless constant.

    Their largest deviation from the mean must be from 1e-75 to 1e75.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        largest = float(np.abs(samples - samples.mean()).max())
    if largest != 0.0 and not DEVIATION_RANGE[0] <= largest <= DEVIATION_RANGE[1]:
        raise InputError(
            f"{label} deviates from its mean by {largest:.2g} at most: {of} needs {DEVIATION_RANGE[0]:g} to"
            f" {DEVIATION_RANGE[1]:g}; convert the samples to another unit"
        )


def sample_index(seconds: float, rate: float) -> int:
    """Index of the sample nearest to a time, maybe outside of the record; raises `InputError` for NaN and infinity."""
    at = _number(seconds) * rate
    if not math.isfinite(at):
        raise InputError(f"{seconds!r} s: a time must be a finite number of seconds")
    return round(at)


def whole(value: object, name: str, least: int, most: int, remedy: str = "") -> int:
    """Value as an int; raises `InputError` unless it is whole (5.0 is, text is not) and from `least` to `most`."""
    try:
        exact: int | None = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = math.nan if isinstance(value, (str, bytes)) else _number(value)
        exact = int(number) if number.is_integer() else None
    if exact is None:
        raise InputError(f"{name} = {value!r}: a whole number is needed{remedy and f', {remedy}'}")
    if not least <= exact <= most:
        span = f"from {least}" if exact < least else f"up to {most}"
        raise InputError(
            f"{name} = {exact}: a whole number {span} is needed{remedy and f', {remedy}'}"
        )
    return exact


def _number(value: object) -> float:
    """Value, maybe a text, as a float; NaN if it is no number, infinity if it is an int beyond the range of floats."""
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf
    except (TypeError, ValueError):
        return math.nan

"""Numbers as they were asked for: checked where they come in, one line for each that cannot be used."""

from __future__ import annotations

import math
import operator
from os import PathLike, fspath
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "LARGEST",
    "SEEDS",
    "check_size",
    "floats",
    "moment",
    "places",
    "positive",
    "positive_rate",
    "recorded",
    "whole",
]

#: Seeds are 64 bits of the generator's key.
SEEDS = 2**64 - 1
#: Numbers beyond have no square that is a number.
LARGEST = 1e150
#: Largest deviation of a sample from the mean. Powers are squared, and the fourth powers of these are 1e-300 and 1e300.
DEVIATIONS = (1e-75, 1e75)
#: Rates up to which products of powers of them and of coefficients are numbers, Hz.
FASTEST = 1e30


def positive(value: object, name: str, unit: str, remedy: str) -> float:
    """A finite number above 0.

    Parameters
    ----------
    value : object
        What was given.
    name, unit, remedy : str
        How the message calls it, and what it says to do.

    Raises
    ------
    InputError
        Anything else.
    """
    number = _number(value)
    if not 0.0 < number <= LARGEST:
        shown = f"{number:g}" if isinstance(value, (int, float)) else repr(value)
        raise InputError(f"{name} = {shown}{f' {unit}' if unit else ''}: {remedy}")
    return number


def positive_rate(rate: object) -> float:
    """A sampling rate in Hz.

    Raises
    ------
    InputError
        No number, not positive, or none whose reciprocal and square are numbers.
    """
    number = _number(rate)
    if math.isnan(number) and not isinstance(rate, float):
        raise InputError(f"the rate must be a number of Hz, found {rate!r}")
    if not 0.0 < number < math.inf:
        raise InputError(f"the rate must be a positive number of Hz, found {number:g}")
    if not 1.0 / FASTEST <= number <= FASTEST:
        raise InputError(
            f"the rate must be from {1 / FASTEST:g} to {FASTEST:g} Hz, found {number:g}"
        )
    return number


def recorded(given: object) -> None:
    """What is computed of a recording (or of a summary, its stand-in) is given one.

    Raises
    ------
    InputError
        Anything else.
    """
    if hasattr(given, "columns") and hasattr(given, "rate"):
        return
    if isinstance(given, (str, PathLike)):
        path = fspath(given)
        raise InputError(f"{path!r} is a path, no recording: give al.read({path!r})")
    what = "an array" if hasattr(given, "__array__") or isinstance(given, (list, tuple)) else ""
    raise InputError(
        f"{what or type(given).__name__} is no recording:"
        " give al.Recording(x, rate=…, unit=…), or al.read(path)"
    )


def floats(values: object, name: str) -> NDArray[np.float64]:
    """An array of real numbers.

    Raises
    ------
    InputError
        Text, complex numbers, a mapping or anything else that holds no real numbers.
    """
    try:
        given = np.asarray(values)
        if given.dtype.kind in "biufO":
            return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{name}: numbers are needed, found {str(values)[:40]!r}")


def places(values: object, name: str, unit: str) -> NDArray[np.float64]:
    """An array of frequencies or times: what products of two rates or of their reciprocals can be.

    Raises
    ------
    InputError
        No numbers, or one that is not from 1e-60 to 1e60.
    """
    numbers = floats(values, name)
    low, high = FASTEST**-2, FASTEST**2
    wrong = numbers[~((numbers >= low) & (numbers <= high))]
    if wrong.size:
        raise InputError(f"{name} must be from {low:g} to {high:g} {unit}, found {wrong.flat[0]:g}")
    return numbers


def check_size(samples: NDArray[np.float64], label: str, of: str) -> None:
    """Refuse samples whose fourth powers are no doubles.

    Parameters
    ----------
    samples : ndarray, shape (n,)
    label, of : str
        How the message calls them, and what needs them: "a fit".

    Raises
    ------
    InputError
        The largest deviation from the mean is not within `DEVIATIONS`, and the samples are not constant.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        largest = float(np.abs(samples - samples.mean()).max())
    if largest != 0.0 and not DEVIATIONS[0] <= largest <= DEVIATIONS[1]:
        raise InputError(
            f"{label} deviates from its mean by {largest:.2g} at most: {of} needs {DEVIATIONS[0]:g} to"
            f" {DEVIATIONS[1]:g}; convert the samples to another unit"
        )


def moment(seconds: float, rate: float) -> int:
    """Number of the sample at a time.

    Raises
    ------
    InputError
        NaN or infinite seconds.
    """
    at = _number(seconds) * rate
    if not math.isfinite(at):
        raise InputError(f"{seconds!r} s: a time from the first sample is a finite number")
    return round(at)


def whole(value: object, name: str, least: int, most: int, remedy: str = "") -> int:
    """A whole number from `least` to `most`; 5.0 is one, 1.5 is not.

    Raises
    ------
    InputError
        Anything else.
    """
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
    """As a float; NaN for what is none, infinity for what is too large."""
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf
    except (TypeError, ValueError):
        return math.nan

"""What an estimator is to the package: name, title, kernel, reach, degrees of freedom, bias, unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["ESTIMATORS", "Estimator", "estimator_named"]

Ints: TypeAlias = "NDArray[np.int64]"
Floats: TypeAlias = "NDArray[np.float64]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """One deviation.

    Attributes
    ----------
    name : str
        Of its function, of the command line's choice, and of results.
    title : str
        In words, for plots.
    source : str
        Where it is defined.
    kernel : callable
        Variance of the samples (of interval errors: the square) at each factor, number of terms, exponent
        of the noise, number of gaps: ``kernel(samples, factors, angle)``.
    most : callable
        Largest averaging factor of so many phase points.
    terms : callable
        Terms at each averaging factor of so many phase points without gaps.
    edf : callable or None
        Degrees of freedom from exponent, factor, number of terms and of phase points; None: not known.
    bias : callable or None
        Variance over the true one from exponent, factor and number of phase points.
    unbiased : bool
        Whether that is divided out unless asked for otherwise.
    gain : callable or None
        Of estimators of the phase, what a rate gains in τ: their scale from that of the rate, averaging times and
        sampling rate.
    """

    name: str
    title: str
    source: str
    kernel: Callable[[NDArray[Any], Ints, bool], tuple[Floats, Ints, Floats, int]]
    most: Callable[[int], int]
    terms: Callable[[Ints, int], Ints]
    edf: Callable[[float, int, int, int], float] | None = None
    bias: Callable[[int, int, int], float] | None = None
    unbiased: bool = True
    gain: Callable[[float, Floats, float], Floats | float] | None = None

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return estimator_named, (
            self.name,
        )  # its functions cannot be pickled, and the table has them

    def complete(self, m: Ints, points: int) -> Ints:
        """Terms at each averaging factor of a record of `points` phase points without gaps."""
        return np.asarray(np.maximum(self.terms(m, points), 0), np.int64)

    def freedom(self, alpha: Floats, m: Ints, n: Ints, points: int) -> Floats:
        """Equivalent degrees of freedom at each τ; NaN without an estimate or where none are known."""
        if self.edf is None:
            return np.full(m.size, np.nan)
        rows = zip(alpha, m, n, strict=True)
        values = [self.edf(float(a), int(f), int(c), points) if c else np.nan for a, f, c in rows]
        return np.array(values)


#: Every estimator by its name, in the order in which they are offered; filled by `estimators.py`.
ESTIMATORS: dict[str, Estimator] = {}


def estimator_named(name: str) -> Estimator:
    """Estimator of that name.

    Raises
    ------
    InputError
        There is none.
    """
    try:
        return ESTIMATORS[name]
    except KeyError:
        raise InputError(f"unknown deviation {name!r}: one of {', '.join(ESTIMATORS)}") from None

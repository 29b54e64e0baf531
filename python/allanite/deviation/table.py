"""Definition of an estimator: name, title, kernel, range, degrees of freedom, bias, unit, and how users choose it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

Ints: TypeAlias = "NDArray[np.int64]"
Floats: TypeAlias = "NDArray[np.float64]"


class Entry(NamedTuple):
    """Entry of an estimator in a list from which users choose; entries are sorted by `place`, in steps of 10."""

    place: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """Definition of one deviation.

    Attributes
    ----------
    name, title, source : str
        Name of its function, of the command-line option and of results; title for plots; publication that defines it.
    use : Entry
        When to use it, for the help of the command line. Estimators with the same text share a line.
    choice : Entry or None
        Its name in the menu of the page. None if the page does not offer it, because it is slow for long records or has
        no interval.
    symbol : str
        Symbol that clock manufacturers use for it if the samples are fractional frequency; empty if there is none.
    allan : bool
        True if its expectation is the Allan deviation of a model.
    kernel : callable
        ``kernel(samples, factors, angle)`` returns the variance at each factor (the square, for interval errors), number
        of averaged differences, noise exponent, and number of missing samples.
    most, terms : callable
        Largest averaging factor, and number of averaged differences at each, for a number of phase points without gaps.
    edf : callable or None
        Degrees of freedom from noise exponent, factor, and numbers of differences and phase points; None if not known.
    bias : callable or None
        Ratio of the mean variance to the true one, from exponent, factor and number of phase points; None without bias.
    unbiased : bool
        True if variances are divided by the bias unless the caller asks otherwise.
    gain : callable or None
        For estimators of the phase: their scale from the scale of the rate, averaging times and sampling rate.
    """

    name: str
    title: str
    source: str
    use: Entry
    choice: Entry | None = None
    symbol: str = ""
    allan: bool = False
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

    def max_terms(self, m: Ints, points: int) -> Ints:
        """Number of averaged differences at each averaging factor, shape (k,), for `points` phase points without gaps."""
        return np.asarray(np.maximum(self.terms(m, points), 0), np.int64)

    def edf_at(self, alpha: Floats, m: Ints, n: Ints, points: int) -> Floats:
        """Equivalent degrees of freedom at each averaging factor m; NaN where `n` is 0, and without a formula."""
        if self.edf is None:
            return np.full(m.size, np.nan)
        rows = zip(alpha, m, n, strict=True)
        values = [self.edf(float(a), int(f), int(c), points) if c else np.nan for a, f, c in rows]
        return np.array(values)


#: Every estimator by its name, in the order of the documentation; filled by `estimators.py`.
ESTIMATORS: dict[str, Estimator] = {}


def estimator_named(name: str) -> Estimator:
    """Estimator with this name; raises `InputError` if there is none."""
    try:
        return ESTIMATORS[name]
    except KeyError:
        raise InputError(f"unknown deviation {name!r}: one of {', '.join(ESTIMATORS)}") from None

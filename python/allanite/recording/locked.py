"""Columns that hardly leave one code: rounding hides the noise, and a bound is all that they tell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.recording.resolution import FLIPS, is_fill

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Locked", "locked_of"]

#: Share of samples of one code from which on a column is locked. Normal noise in the middle of a code then has a standard
#: deviation below a quarter of the step, and N of the rounded samples is 13 % too low or worse, depending on the mean.
MIN_SHARE = 0.95
#: One-sided probability of the limits of the two shares that leave the code: together 95 %.
LIMIT = 0.975
#: Most different values of a column that is looked at, and samples that are looked at first: hardly any column goes on.
MOST_CODES, FIRST = 16, 4096


@dataclass(frozen=True, slots=True)
class Locked:
    """How a column is locked to one code.

    Attributes
    ----------
    share : float
        Share of samples that have the code.
    step : float
        Distance to the nearest other code.
    most : float
        95 % upper limit of the standard deviation of white noise before rounding.
    """

    share: float
    step: float
    most: float


def locked_of(x: NDArray[np.floating | np.integer]) -> Locked | None:
    """Return how samples of shape (n,) are locked to one code, or None.

    Noise with a standard deviation σ and a mean m within the code leaves it upwards with probability Q((½ − m)/σ) and
    downwards with Q((½ + m)/σ), in steps. The two normal quantiles add to 1/σ whatever the mean is, so the upper limits of
    both shares give the upper limit of σ.
    """
    if np.unique(x[:FIRST]).size > MOST_CODES:
        return None
    values = x[np.isfinite(x)] if x.dtype.kind == "f" else x
    codes, counts = np.unique(values, return_counts=True)
    if not 1 < codes.size <= MOST_CODES:
        return None
    usual = int(np.argmax(counts))
    share = float(counts[usual]) / values.size
    # A few odd samples of a dead column are no codes that noise reaches.
    if share < MIN_SHARE or values.size - counts[usual] < FLIPS:
        return None
    distances = np.abs(codes.astype(np.float64) - float(codes[usual]))
    distances[usual] = math.inf
    nearest = int(np.argmin(distances))
    step = float(distances[nearest])
    if is_fill(float(codes[nearest]), step):
        return None
    from scipy.special import betaincinv, ndtri

    quantiles = 0.0
    for outside in (counts[:usual].sum(), counts[usual + 1 :].sum()):
        # Clopper and Pearson (1934): upper limit of a probability from a count.
        most = float(betaincinv(float(outside) + 1.0, float(values.size - outside), LIMIT))
        quantiles -= float(ndtri(most))
    return Locked(share, step, step / quantiles if quantiles > 0.0 else math.inf)

"""Columns that hardly leave one code: rounding hides the noise, and only an upper limit can be given."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.recording.resolution import MIN_FLIPS, is_fill

#: Minimum share of samples with one code of a locked column. Normal noise in the middle of a code then has a standard
#: deviation below a quarter of the step. N of the rounded samples is at least 13 % too low, depending on the mean.
MIN_SHARE = 0.95
#: One-sided probability of the limits of the two shares that leave the code: together 95 %.
LIMIT_PROBABILITY = 0.975
#: Maximum number of different values of a locked column, and samples in which they are counted first, since few columns are
#: locked.
MAX_CODES, FIRST_SAMPLES = 16, 4096


@dataclass(frozen=True, slots=True)
class Locked:
    """How a column is locked to one code.

    `share` of the samples have the code, and `step` is its distance to the nearest other code. `most` is the 95 % upper
    limit of the standard deviation of white noise before rounding.
    """

    share: float
    step: float
    most: float


def locked_of(x: NDArray[np.floating | np.integer]) -> Locked | None:
    """`Locked` if at least 95 % of the samples, but not all, have one value; else None.

    None also for more than 16 different values, if fewer than 5 samples have another value, or if the nearest other value
    is a fill value such as 0.

    Notes
    -----
    Noise with a standard deviation σ and a mean m within the code leaves it upwards with probability Q((½ − m)/σ) and
    downwards with Q((½ + m)/σ), in steps. The sum of the two normal quantiles is 1/σ for any mean. So the upper limits
    (97.5 %) of both shares give the upper limit of σ.
    """
    if np.unique(x[:FIRST_SAMPLES]).size > MAX_CODES:
        return None
    values = x[np.isfinite(x)] if x.dtype.kind == "f" else x
    codes, counts = np.unique(values, return_counts=True)
    if not 1 < codes.size <= MAX_CODES:
        return None
    usual = int(np.argmax(counts))
    share = float(counts[usual]) / values.size
    # A few odd samples of a dead column are not codes that noise reaches.
    if share < MIN_SHARE or values.size - counts[usual] < MIN_FLIPS:
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
        most = float(
            betaincinv(float(outside) + 1.0, float(values.size - outside), LIMIT_PROBABILITY)
        )
        quantiles -= float(ndtri(most))
    return Locked(share, step, step / quantiles if quantiles > 0.0 else math.inf)

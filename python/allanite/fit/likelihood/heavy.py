"""Widen the interval of the white-noise coefficient if the samples have heavy tails.

The coefficient N is proportional to the standard deviation of the noise. The sum of squares of heavy-tailed samples
scatters more than that of normal samples: by √((κ−1)/2) with kurtosis κ. Without a finite kurtosis the largest samples
determine the scatter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.parameters import NORMAL
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.recording.tails import CENSORED_SHARES, Tail, coarse_step, tail_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Number of simulated sums of squares from which the 2.5 % and 97.5 % points are taken. Chosen by judgment; not measured.
SUM_DRAWS = 1000
#: Number of largest samples that are drawn individually; the sum of the others is nearly normal.
#: Chosen by judgment; not measured.
DRAWN_LARGEST = 400
#: Number of steps of the integral over the squares of the other samples. Chosen by judgment; not measured.
INTEGRAL_STEPS = 2000
#: Number of entries of the quantile table: log-log interpolation between two entries is accurate to 1e-6.
QUANTILE_TABLE_SIZE = 4096
#: Maximum 1/ν of the Student law used; the variance is infinite from 1/ν = 0.5 on. Chosen by judgment; not measured.
MAX_INVERSE_FREEDOM = 0.48
#: Minimum probability with which the fitted tail must produce a largest sample no larger than the record's.
#: Chosen by judgment; not measured.
MIN_TAIL_PROBABILITY = 1e-3


def widened_by_tails(
    value: float, ends: tuple[float, float], solution: Solution, data: Data
) -> tuple[float, float]:
    """Pair (low, high): 95 % interval `ends` of the white-noise coefficient, widened if the samples have heavy tails.

    `ends` is returned if the tails are not heavy, if the record keeps no single samples, or if the lower end is 0. For
    coarsely rounded samples, the tails are not tested; their kurtosis determines the interval.
    """
    if not data.whole or not ends[0] > 0.0:
        return ends
    white = whitened_ordinates(solution, data, solution.level)
    samples = data.present(_kernels.inverse_cosine_transform(white))
    sizes = np.abs(samples - np.median(samples))
    if coarse_step(data.present(data.samples)) > 0.0:
        few, many = _quantiles_by_kurtosis(sizes)
    else:
        tail = tail_of(sizes, CENSORED_SHARES[0])
        if tail is None or not tail.heavy:
            return ends
        few, many = sum_of_squares_quantiles(tail, sizes)
    # In ln of the coefficient; the scatter that normal samples have is already in `ends`.
    plain = NORMAL / np.sqrt(2.0 * sizes.size)
    down, up = 0.5 * np.log(many), -0.5 * np.log(few)
    low = np.hypot(np.log(value / ends[0]), np.sqrt(max(down**2 - plain**2, 0.0)))
    high = np.hypot(np.log(ends[1] / value), np.sqrt(max(up**2 - plain**2, 0.0)))
    return float(value * np.exp(-low)), float(value * np.exp(high))


def sum_of_squares_quantiles(tail: Tail, sizes: Array) -> tuple[float, float]:
    """Pair: 2.5 % and 97.5 % points of the sum of squares of heavy-tailed samples, relative to its expectation.

    `sizes` are |samples|. The points are those of the Student law of `tail`. If the largest sample of the record would be
    improbably small for this law (0.1 %), they follow from the kurtosis of the samples instead.
    """
    from scipy.special import stdtr

    n = sizes.size
    light = max(tail.low, 1e-3)
    beyond = 2.0 * float(stdtr(1.0 / light, -float(sizes.max()) / tail.scale))
    if n * beyond > -np.log(MIN_TAIL_PROBABILITY):
        # The record's tail is shorter than that of a Student law (e.g. Laplace): use its kurtosis.
        return _quantiles_by_kurtosis(sizes)
    return _quantiles_of_student(min(tail.inverse_freedom, MAX_INVERSE_FREEDOM), n)


def _quantiles_by_kurtosis(sizes: Array) -> tuple[float, float]:
    """Pair: 2.5 % and 97.5 % points of the sum of squares of samples with these |samples|, divided by its expectation.

    The points are exp(∓1.96 s/√n), by the central limit theorem: s is the relative standard deviation of the n squares.
    """
    squares = sizes**2
    spread = NORMAL * float(squares.std() / squares.mean()) / np.sqrt(sizes.size)
    return float(np.exp(-spread)), float(np.exp(spread))


def _quantiles_of_student(inverse: float, n: int) -> tuple[float, float]:
    """Pair: 2.5 % and 97.5 % points of the sum of squares over its expectation for n samples of a Student law.

    `inverse` is 1/ν. The largest samples are drawn one by one, the sum of the others from its mean and variance.
    """
    from scipy.special import stdtrit

    rng = np.random.default_rng(0)
    freedom = 1.0 / inverse
    largest = min(DRAWN_LARGEST, n // 4)
    # Rényi's representation of the smallest of n uniform random numbers.
    steps = rng.standard_exponential((SUM_DRAWS, largest + 1))
    steps[:, -1] = rng.standard_gamma(n - largest, SUM_DRAWS)
    uniform = np.cumsum(steps[:, :-1], axis=1) / (np.cumsum(steps, axis=1)[:, -1:])
    # A table of quantiles is faster than one quantile per random number.
    table = np.geomspace(uniform.min(), uniform.max(), QUANTILE_TABLE_SIZE)
    sizes = np.log(-stdtrit(freedom, 0.5 * table))
    top = np.exp(2.0 * np.interp(np.log(uniform), np.log(table), sizes)).sum(axis=1)
    # The others are uniform in probability below the last of these; the grid is denser where the squares are steeper.
    edges = np.geomspace(0.1 * largest / n, 1.0, INTEGRAL_STEPS + 1)
    widths = np.diff(edges)
    squares = stdtrit(freedom, 0.25 * (edges[1:] + edges[:-1])) ** 2
    last = uniform[:, -1]
    below = [
        np.interp(last, edges, np.append(np.cumsum((widths * s)[::-1])[::-1], 0.0)) / (1.0 - last)
        for s in (squares, squares**2)
    ]
    others = n - largest
    deviation = np.sqrt(np.maximum(below[1] - below[0] ** 2, 0.0) * others)
    total = top + others * below[0] + deviation * rng.standard_normal(SUM_DRAWS)
    total /= n * freedom / (freedom - 2.0)
    return float(np.quantile(total, 0.025)), float(np.quantile(total, 0.975))

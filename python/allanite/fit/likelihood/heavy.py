"""What heavy tails do to the interval of the white noise.

N is the noise's standard deviation in disguise, and the sum of squares of heavy-tailed samples scatters more than that of
normal ones: by √((κ−1)/2) with a kurtosis κ, and where it has none by what the few largest samples do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.parameters import NORMAL
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.recording.tails import CENSORED, Tail, coarse_step, tail_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["widened_by_tails"]

Array = NDArray[np.float64]
#: Draws of a sum of squares, largest samples drawn one by one, and steps of the integral over the others.
DRAWS, LARGEST, STEPS = 1000, 400, 2000
#: Quantiles in a table: between two of them the logarithms are straight to 1e-6.
TABLE = 4096
#: Largest 1/ν of which a variance is spoken.
STEEPEST = 0.48
#: A law whose largest sample would be smaller than the record's no more often than this is not the record's.
UNLIKELY = 1e-3


def widened_by_tails(
    value: float, ends: tuple[float, float], solution: Solution, data: Data
) -> tuple[float, float]:
    """The 95 % interval of the white coefficient with the tails of the record's own samples."""
    if solution.ordinates.size != data.n or not ends[0] > 0.0:
        return ends
    white = whitened_ordinates(solution, data, solution.level)
    samples = _kernels.inverse_cosine_transform(white)
    if data.missing is not None:
        samples = samples[~data.missing]
    sizes = np.abs(samples - np.median(samples))
    there = data.samples if data.missing is None else data.samples[~data.missing]
    if coarse_step(there) > 0.0:
        few, many = _by_kurtosis(sizes)
    else:
        tail = tail_of(sizes, CENSORED[0])
        if tail is None or not tail.heavy:
            return ends
        few, many = ratios(tail, sizes)
    # In ln of the coefficient, in place of what normal samples would do.
    plain = NORMAL / np.sqrt(2.0 * sizes.size)
    down, up = 0.5 * np.log(many), -0.5 * np.log(few)
    low = np.hypot(np.log(value / ends[0]), np.sqrt(max(down**2 - plain**2, 0.0)))
    high = np.hypot(np.log(ends[1] / value), np.sqrt(max(up**2 - plain**2, 0.0)))
    return float(value * np.exp(-low)), float(value * np.exp(high))


def ratios(tail: Tail, sizes: Array) -> tuple[float, float]:
    """2.5 % and 97.5 % points of the sum of squares of a record over its expectation."""
    from scipy.special import stdtr

    n = sizes.size
    light = max(tail.low, 1e-3)
    beyond = 2.0 * float(stdtr(1.0 / light, -float(sizes.max()) / tail.scale))
    if n * beyond > -np.log(UNLIKELY):
        # The tail ends before that of the law does (Laplace): the record's own kurtosis.
        return _by_kurtosis(sizes)
    return _sums(min(tail.inverse_freedom, STEEPEST), n)


def _by_kurtosis(sizes: Array) -> tuple[float, float]:
    """The same by the central limit theorem."""
    squares = sizes**2
    spread = NORMAL * float(squares.std() / squares.mean()) / np.sqrt(sizes.size)
    return float(np.exp(-spread)), float(np.exp(spread))


def _sums(inverse: float, n: int) -> tuple[float, float]:
    """The same for n samples of a Student law: the largest drawn one by one, the others by their mean and variance."""
    from scipy.special import stdtrit

    rng = np.random.default_rng(0)
    freedom = 1.0 / inverse
    largest = min(LARGEST, n // 4)
    # Renyi's representation of the smallest of n uniform numbers.
    steps = rng.standard_exponential((DRAWS, largest + 1))
    steps[:, -1] = rng.standard_gamma(n - largest, DRAWS)
    chance = np.cumsum(steps[:, :-1], axis=1) / (np.cumsum(steps, axis=1)[:, -1:])
    # Of so many numbers the quantile is read off a table.
    table = np.geomspace(chance.min(), chance.max(), TABLE)
    sizes = np.log(-stdtrit(freedom, 0.5 * table))
    top = np.exp(2.0 * np.interp(np.log(chance), np.log(table), sizes)).sum(axis=1)
    # The others lie evenly below the last of these; squares at probabilities that are the denser the steeper they are.
    edges = np.geomspace(0.1 * largest / n, 1.0, STEPS + 1)
    widths = np.diff(edges)
    squares = stdtrit(freedom, 0.25 * (edges[1:] + edges[:-1])) ** 2
    last = chance[:, -1]
    below = [
        np.interp(last, edges, np.append(np.cumsum((widths * s)[::-1])[::-1], 0.0)) / (1.0 - last)
        for s in (squares, squares**2)
    ]
    others = n - largest
    deviation = np.sqrt(np.maximum(below[1] - below[0] ** 2, 0.0) * others)
    total = top + others * below[0] + deviation * rng.standard_normal(DRAWS)
    total /= n * freedom / (freedom - 2.0)
    return float(np.quantile(total, 0.025)), float(np.quantile(total, 0.975))

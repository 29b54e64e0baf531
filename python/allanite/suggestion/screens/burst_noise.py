"""Screen of burst noise: two levels, distinguished from a Gauss-Markov process with the same spectrum.

The low-passed residual is judged by both laws: the likelihood of a two-state hidden Markov chain seen through white noise
(Rabiner 1989, Proc. IEEE 77) over that of a Gaussian process of the fitted spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects import CATALOG, Model, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.expected import density
from allanite.suggestion.constants import (
    MIN_BURST_NOISE_LOG_ODDS,
    MIN_BURST_NOISE_ORDINATES,
    MIN_DELTA_LOGL_OVER_SIMPLER,
)
from allanite.suggestion.screens._screen import Candidate, Context, Screen

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

Array = NDArray[np.float64]

#: Number of blocks of samples in a mean dwell time.
BLOCKS_PER_DWELL = 20
#: Minimum and maximum number of blocks of a record in which two levels are searched.
MIN_BLOCKS, MAX_BLOCKS = 128, 1 << 18
#: Number of blocks of one Markov chain; longer records are computed as several chains in parallel.
CHAIN_BLOCKS = 512
#: Number of blocks of a part of a chain. All parts are computed at once, for each level at their begin, and then joined.
#: It changes only the speed: the number of steps in sequence, part + chain/part, is smallest near √512 = 23.
PART_BLOCKS = 32


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple with one refitted `Candidate` of burst noise, if the samples may switch between two levels; otherwise empty.

    A Gauss–Markov process has the same spectrum, so the search starts from its candidate. The ΔlogL of burst noise is that
    of this candidate, plus the log odds of two levels, minus ln 1000. The last term prefers the Gauss–Markov process if the
    odds are below 1000 : 1. Empty if one of the two ΔlogL is below 8.
    """
    candidates, data = context.found["spectral"], context.data
    twins = [cls for cls in CATALOG if issubclass(cls, Stochastic) and cls.screened == "two levels"]
    pairs = ((c, cls.like(c.effect)) for cls in twins for c in candidates)
    found, effect = next(((c, twin) for c, twin in pairs if twin is not None), (None, None))
    if found is None or found.solution is None or found.gain < MIN_DELTA_LOGL_OVER_SIMPLER:
        return ()
    if max(c.gain for c in candidates) - found.gain > MIN_BURST_NOISE_LOG_ODDS:
        # The spectrum is not that of a Gauss-Markov process: its shape, not the levels, would refute the Gaussian law.
        return ()
    gain = found.gain + _log_odds(found.solution, data) - MIN_BURST_NOISE_LOG_ODDS
    if gain < MIN_DELTA_LOGL_OVER_SIMPLER:
        return ()
    assert effect is not None
    refitted = solve(
        data, Model((*found.solution.model.effects[:-1], effect)), polish=False, rounds=3
    )
    return (
        Candidate(
            refitted.model.effects[-1],
            gain,
            found.family,
            refitted,
            found.parameters,
            judged_gain=found.gain,
        ),
    )


SCREEN = Screen(
    "burst noise",
    "two levels: the distribution of the samples, if a process with the same spectrum was found",
    "time",
    look,
    after=("spectral",),
    searches=lambda _: 0,
)


def _log_odds(solution: Solution, data: Data) -> float:
    """Logarithm of the likelihood ratio of two levels to Gaussian noise with the same spectrum; 0 if it cannot be known.

    The last process of the model must be the Gauss–Markov process. Means over blocks of 1/20 of its dwell time are
    compared.
    """
    process = solution.model.stochastic[-1]
    time, sigma = float(process.values["correlation_time"]), float(process.values["sigma"])
    length = max(1, round(2.0 * time / BLOCKS_PER_DWELL * data.rate))
    count = data.n // length
    # A summary keeps only the lowest ordinates, which show no levels.
    if not MIN_BLOCKS <= count <= MAX_BLOCKS or not data.whole:
        return 0.0
    whole = count * length
    j = np.arange(1, whole, dtype=np.int64)
    total = density(data.terms(solution.model), j, whole)
    one = density(data.unit_terms(solution.model, process), j, whole)
    total, process_power = (
        _ordinates_of_means(part, length) for part in (total, solution.processes[-1].theta * one)
    )
    spectrum = np.maximum(total - process_power, 1e-300), process_power
    # Ordinates in which a slow drift exceeds the process show no levels. But unequal times on the two levels may be fitted
    # as a drift. Without these ordinates the levels would be incomplete, so several cuts are tried.
    slow = int(np.argmax(process_power > spectrum[0]))
    block = _Blocks(length, count, length / data.rate / (2.0 * time), sigma)
    return max(_odds_above(cut, solution, spectrum, block) for cut in {slow, slow // 2, 0})


def _ordinates_of_means(power: Array, length: int) -> Array:
    """Expected power spectrum of means over blocks of `length` samples, from that of the samples, without frequency 0.

    Power above the Nyquist frequency of the means is folded back (aliasing).
    """
    count = (power.size + 1) // length
    j = np.arange(1, power.size + 1)
    angle = np.pi * j / (2.0 * count * length)
    response = (np.sin(length * angle) / (length * np.sin(angle))) ** 2
    image = j % (2 * count)
    folded = np.bincount(np.minimum(image, 2 * count - image), power * response)
    return np.asarray(folded[1:count] / length)


@dataclass(frozen=True, slots=True)
class _Blocks:
    """Samples per block, number of blocks, block length in mean dwell times, and half the distance of the levels."""

    length: int
    count: int
    dwells: float
    sigma: float


def _odds_above(
    slow: int, solution: Solution, spectrum: tuple[Array, Array], block: _Blocks
) -> float:
    """Logarithm of the likelihood ratio of a two-level process (burst noise) to Gaussian noise, from means over blocks.

    Only frequencies above the ordinate `slow` are used. `spectrum` is a pair: expected power of the other noise and of a
    Gauss–Markov process at each ordinate. 0 if this process exceeds the other noise at too few of the ordinates.
    """
    from scipy.optimize import minimize

    other_power, process_power = (part[slow:] for part in spectrum)
    if int((process_power > other_power).sum()) < max(4 * slow, MIN_BURST_NOISE_ORDINATES):
        return 0.0
    ordinates = solution.ordinates.copy()
    ordinates[: slow + 1] = 0.0
    series = _kernels.inverse_cosine_transform(ordinates)
    means = series[: block.count * block.length].reshape(block.count, block.length).mean(axis=1)
    expected = other_power + process_power
    z = _kernels.cosine_transform(np.ascontiguousarray(means))[slow + 1 :]
    noise = float(np.median(other_power))
    gaussian = -0.5 * float(np.sum(np.log(2.0 * np.pi * expected) + z**2 / expected))

    def loss(shift: Array) -> float:
        """Negative logL of the two-state chain if (ln level, ln dwell time, ln noise power, mean) change by `shift`."""
        level = block.sigma * np.exp(shift[0])
        stay = float(np.exp(-block.dwells * np.exp(-shift[1])))
        variance = noise * float(np.exp(shift[2]))
        chain = _chain_log_likelihood(means - block.sigma * shift[3], level, variance, stay)
        # The chain has seen zeros in the place of the omitted ordinates.
        return -chain - 0.5 * (slow + 1) * float(np.log(2.0 * np.pi * variance))

    start = np.vstack([np.zeros(4), np.diag([0.2, 0.3, 0.2, 0.2])])
    found: Any = minimize(
        loss,
        start[0],
        method="Nelder-Mead",
        options={"initial_simplex": start, "maxfev": 100, "fatol": 0.3, "xatol": 0.02},
    )
    return -float(found.fun) - gaussian


def _chain_log_likelihood(means: Array, level: float, noise: float, stay: float) -> float:
    """Log-likelihood of block means of a process that switches between ±`level`, in white noise of variance `noise`.

    `stay` is the probability e^{−block/dwell} of no switch within a block. In a block with a switch, the mean lies anywhere
    between the levels.
    """
    from scipy.special import ndtr

    keep = 0.5 * (1.0 + stay**2)
    segments = -(-means.size // CHAIN_BLOCKS)
    padded = np.full(segments * CHAIN_BLOCKS, np.nan)
    padded[: means.size] = means
    rows = padded.reshape(-1, PART_BLOCKS).T
    root, spread = stay / np.sqrt(2.0 * np.pi * noise), np.sqrt(noise)
    between = (1.0 - stay) / (2.0 * level)
    between = between * (ndtr((rows + level) / spread) - ndtr((rows - level) / spread)) + 1e-290
    up = root * np.exp(-0.5 * (rows - level) ** 2 / noise) + between
    down = root * np.exp(-0.5 * (rows + level) ** 2 / noise) + between
    up, down = (np.where(np.isfinite(rows), x, 1.0) for x in (up, down))
    share: Array = np.repeat([[1.0], [0.0]], rows.shape[1], axis=1)
    total: Array = np.zeros(share.shape)
    for higher, lower in zip(up, down, strict=True):
        share = (1.0 - keep) + (2.0 * keep - 1.0) * share
        seen = share * higher + (1.0 - share) * lower
        share = share * higher / seen
        total += np.log(seen)
    # Axes: level at the begin of a part, place of the part in its chain, chain.
    share, total = (x.reshape(2, segments, -1).swapaxes(1, 2) for x in (share, total))
    largest = total.max(axis=0)
    weight = np.exp(total - largest)
    begin, sums = np.full(segments, 0.5), np.empty(largest.shape)
    for part, (own, ends) in enumerate(
        zip(weight.swapaxes(0, 1), share.swapaxes(0, 1), strict=True)
    ):
        one, other = begin * own[0], (1.0 - begin) * own[1]
        sums[part] = one + other
        begin = (one * ends[0] + other * ends[1]) / sums[part]
    return float((largest + np.log(sums)).sum())

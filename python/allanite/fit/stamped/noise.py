"""Noise at any time: the lags, the random walk and the white part of primitive terms.

A term is defined per sample. Its lags (`power_law_bank`) decay continuously between samples, so that at equal distances
the process is that of the term, and at other distances the one that runs through it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.effects.terms import Blue, Exponential, Flicker, PowerLaw, RandomWalk, White

if TYPE_CHECKING:
    from allanite.effects.terms import Term

__all__ = ["StampedNoise", "added", "integrated_noise", "sampled_noise"]

Array = NDArray[np.float64]
#: Rate of a lag that stands for a random walk, over that of the record: its variance at the ends differs by 0.01 %.
SLOW = 1e-4


@dataclass(frozen=True)
class StampedNoise:
    """White noise, a random walk and lags.

    Attributes
    ----------
    lags : tuple of (float, float, bool)
        Stationary variance, rate λ in 1/s, and whether the integral is seen.
    walk : float
        Variance of the random walk after 1 s.
    white : float
        Variance of the white part.
    """

    lags: tuple[tuple[float, float, bool], ...] = ()
    walk: float = 0.0
    white: float = 0.0

    def scaled(self, factor: float) -> StampedNoise:
        """Return the noise with its variance multiplied by `factor`."""
        lags = tuple((factor * v, rate, summed) for v, rate, summed in self.lags)
        return StampedNoise(lags, factor * self.walk, factor * self.white)


def added(parts: list[StampedNoise]) -> StampedNoise:
    """Return the sum of independent noises; lags of the same rate become one."""
    lags: dict[tuple[float, bool], float] = {}
    for part in parts:
        for variance, rate, summed in part.lags:
            lags[rate, summed] = lags.get((rate, summed), 0.0) + variance
    return StampedNoise(
        tuple((variance, rate, summed) for (rate, summed), variance in lags.items()),
        sum(part.walk for part in parts),
        sum(part.white for part in parts),
    )


def sampled_noise(term: Term, rate: float, n: int) -> StampedNoise:
    """Return a term whose values are the samples.

    Parameters
    ----------
    term : Term
        White, flicker, random walk, a real lag, or a power law of exponent −2 to 0.
    rate : float
        Samples a second to which the term belongs.
    n : int
        Samples in the length of the record, for the slowest lag.
    """
    if isinstance(term, White):
        return StampedNoise(white=term.variance)
    if isinstance(term, RandomWalk):
        return StampedNoise(walk=term.variance * rate)
    if isinstance(term, Exponential) and complex(term.phi).imag == 0.0:
        return _of_lags([(complex(term.phi).real, complex(term.a).real)], 1.0, rate)
    exponent, level = _power_law_of(term)
    if exponent == -2.0:
        return StampedNoise(walk=level * rate)
    if not -2.0 < exponent <= 0.0:
        raise _unknown(term)
    return _of_lags(_kernels.power_law_bank(exponent, max(n, 16)), level, rate)


def integrated_noise(term: Term, rate: float, n: int) -> StampedNoise:
    """Return the integral of a term: the phase (s) of a clock whose fractional frequency it is.

    Each lag keeps its density at frequencies far below the sampling rate. Parameters are those of `sampled_noise`;
    quantization and power laws up to exponent 2 are noise of the phase itself.
    """
    step = 1.0 / rate
    if isinstance(term, Blue):
        return StampedNoise(white=term.variance * step**2)
    if isinstance(term, White):
        return StampedNoise(walk=term.variance * step)
    exponent, level = (-2.0, term.variance) if isinstance(term, RandomWalk) else (0.0, 0.0)
    if isinstance(term, Exponential) and complex(term.phi).imag == 0.0:
        return _integrated([(complex(term.phi).real, complex(term.a).real)], 1.0, rate)
    if exponent == 0.0:
        exponent, level = _power_law_of(term)
    if exponent == -2.0:
        slow = SLOW * rate / n
        return StampedNoise(lags=((0.5 * level * rate / slow, slow, True),))
    if 0.0 < exponent <= 2.0:
        return sampled_noise(PowerLaw(exponent - 2.0, level * step**2), rate, n)
    if not -2.0 < exponent <= 0.0:
        raise _unknown(term)
    return _integrated(_kernels.power_law_bank(exponent, max(n, 16)), level, rate)


def _power_law_of(term: Term) -> tuple[float, float]:
    if isinstance(term, Flicker):
        return -1.0, term.variance
    if isinstance(term, PowerLaw):
        return term.exponent, term.level
    raise _unknown(term)


def _unknown(term: Term) -> InputError:
    return InputError(f"a process {term.name!r} has no form at arbitrary times")


def _of_lags(bank: list[tuple[float, float]], level: float, rate: float) -> StampedNoise:
    lags = tuple((level * v, -float(np.log(phi)) * rate, False) for phi, v in bank if phi > 0.0)
    return StampedNoise(lags, white=level * sum(v for phi, v in bank if phi <= 0.0))


def _integrated(bank: list[tuple[float, float]], level: float, rate: float) -> StampedNoise:
    lags, walk = [], 0.0
    for phi, v in bank:
        if phi <= 0.0:
            walk += level * v / rate
            continue
        half = -0.5 * float(np.log(phi))
        lags.append((level * v * half / float(np.tanh(half)), 2.0 * half * rate, True))
    return StampedNoise(tuple(lags), walk)

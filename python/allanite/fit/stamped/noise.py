"""Noise at arbitrary times: white noise, a random walk and Gauss–Markov processes (exponentially correlated).

A term is defined per sample. Its Gauss–Markov processes (`power_law_bank`) decay continuously between samples. At equal
intervals the process equals the term; at other times it is the continuous process through the same points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.effects.terms import Term

#: Decay rate of the process that represents a random walk, times the duration of the record. Its variance at the end of the
#: record then differs by 0.01 %.
RANDOM_WALK_DECAY = 1e-4
#: Exponents of the spectra of terms with a variance; the variance is the level.
POWER_LAW_EXPONENTS = {"blue": 2.0, "white": 0.0, "flicker": -1.0, "random_walk": -2.0}


@dataclass(frozen=True)
class StampedNoise:
    """Sum of white noise, a random walk and Gauss–Markov processes (exponentially correlated noise).

    `gauss_markov` has for each process its stationary variance, decay rate λ in 1/s, and True if the samples contain its
    integral. `walk` is the variance of the random walk after 1 s, `white` that of the white noise of each sample.
    """

    gauss_markov: tuple[tuple[float, float, bool], ...] = ()
    walk: float = 0.0
    white: float = 0.0

    def scaled(self, factor: float) -> StampedNoise:
        """Copy of the noise with its variance multiplied by `factor`."""
        gauss_markov = tuple((factor * v, rate, summed) for v, rate, summed in self.gauss_markov)
        return StampedNoise(gauss_markov, factor * self.walk, factor * self.white)


def sum_of_noises(parts: list[StampedNoise]) -> StampedNoise:
    """`StampedNoise`: sum of independent noises; Gauss–Markov processes with the same decay rate are merged."""
    gauss_markov: dict[tuple[float, bool], float] = {}
    for part in parts:
        for variance, rate, summed in part.gauss_markov:
            gauss_markov[rate, summed] = gauss_markov.get((rate, summed), 0.0) + variance
    return StampedNoise(
        tuple((variance, rate, summed) for (rate, summed), variance in gauss_markov.items()),
        sum(part.walk for part in parts),
        sum(part.white for part in parts),
    )


def sampled_noise(term: Term, rate: float, n: int) -> StampedNoise:
    """`StampedNoise` of samples that are the values of a spectral term, which refers to the sampling rate `rate`, Hz.

    The term is white, flicker, random walk, Gauss–Markov, or a power law of exponent −2 to 0; `InputError` for any other.
    `n`, the number of samples of the record at that rate, determines the slowest process of a power law.
    """
    process = _gauss_markov_of(term)
    if process is not None:
        return _noise_of_bank([process], 1.0, rate)
    return _sampled_power_law(*_power_law_of(term), rate, n)


def _sampled_power_law(exponent: float, level: float, rate: float, n: int) -> StampedNoise:
    """`StampedNoise` of n samples at `rate` Hz with a power-law spectrum; InputError for an exponent outside −2 … 0.

    The spectrum is `level` · (2 sin(w/2))^`exponent` at w = 2πf/`rate`: white noise of variance `level` for 0, a random
    walk with steps of this variance for −2.
    """
    if exponent == 0.0:
        return StampedNoise(white=level)
    if exponent == -2.0:
        return StampedNoise(walk=level * rate)
    if not -2.0 < exponent < 0.0:
        raise _unsupported(exponent)
    return _noise_of_bank(_kernels.power_law_bank(exponent, max(n, 16)), level, rate)


def integrated_noise(term: Term, rate: float, n: int) -> StampedNoise:
    """`StampedNoise` of samples that are the integral of a spectral term over time, e.g. the phase (s) of a clock.

    The integral of a Gauss–Markov process keeps its density at frequencies far below the sampling rate. Quantization, and
    power laws with exponents above 0 up to 2, become noise of the phase itself. `InputError` for exponents outside −2 … 2
    and for terms of any other kind.
    """
    process = _gauss_markov_of(term)
    if process is not None:
        return _integral_of_bank([process], 1.0, rate)
    exponent, level = _power_law_of(term)
    step = 1.0 / rate
    if exponent > 0.0:
        return _sampled_power_law(exponent - 2.0, level * step**2, rate, n)
    if exponent == 0.0:
        return StampedNoise(walk=level * step)
    if exponent == -2.0:
        slow = RANDOM_WALK_DECAY * rate / n
        return StampedNoise(gauss_markov=((0.5 * level * rate / slow, slow, True),))
    if exponent < -2.0:
        raise _unsupported(exponent)
    return _integral_of_bank(_kernels.power_law_bank(exponent, max(n, 16)), level, rate)


def _gauss_markov_of(term: Term) -> tuple[float, float] | None:
    """Pair: decay factor per sample and variance of a term with exponential covariance; None for any other term."""
    name, numbers = term.kernel
    if name != "exponential" or numbers[3] != 0.0:
        return None
    return numbers[2], numbers[0]


def _power_law_of(term: Term) -> tuple[float, float]:
    """Pair: exponent and level of a term with the spectrum level · (2 sin(πf/rate))^exponent per sample.

    `InputError` for other terms.
    """
    name, numbers = term.kernel
    if name == "power_law":
        return numbers[0], numbers[1]
    if name not in POWER_LAW_EXPONENTS:
        raise _unsupported(repr(name))
    return POWER_LAW_EXPONENTS[name], numbers[0]


def _unsupported(process: object) -> InputError:
    """InputError (returned, not raised) for a process, or an exponent, that cannot be evaluated at arbitrary times."""
    return InputError(f"process {process} is not supported for samples at arbitrary times")


def _noise_of_bank(bank: list[tuple[float, float]], level: float, rate: float) -> StampedNoise:
    """`StampedNoise`: sum of first-order autoregressive processes of samples at `rate` Hz.

    `bank` lists (decay factor per sample, variance) of each process. `level` multiplies all variances. A decay factor of 0
    is white noise.
    """
    gauss_markov = tuple(
        (level * v, -float(np.log(phi)) * rate, False) for phi, v in bank if phi > 0.0
    )
    return StampedNoise(gauss_markov, white=level * sum(v for phi, v in bank if phi <= 0.0))


def _integral_of_bank(bank: list[tuple[float, float]], level: float, rate: float) -> StampedNoise:
    """`StampedNoise` of the integral of the processes of `_noise_of_bank`; that of white noise is a random walk."""
    gauss_markov, walk = [], 0.0
    for phi, v in bank:
        if phi <= 0.0:
            walk += level * v / rate
            continue
        half = -0.5 * float(np.log(phi))
        gauss_markov.append((level * v * half / float(np.tanh(half)), 2.0 * half * rate, True))
    return StampedNoise(tuple(gauss_markov), walk)

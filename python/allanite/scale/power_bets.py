"""Bets on the total power of whitened samples, valid for any distribution of the samples.

Let w be a whitened sample; under the model, w² has mean 1. The bets use v, which is w² clipped at a limit, so that no
single sample dominates. The factor 1 + λ (v/m − 1) is never negative. Its mean is at most 1 if the mean of v is at most m
(λ > 0) or at least m (λ < 0), for any distribution of w. The product over independent samples is therefore an e-value.

Clipping lowers the mean of v. Bets on more power (λ > 0) are then conservative. Bets on less power need an upper bound on
the clipped power, which depends on the tails of the samples. `ClippedPower` computes this bound from the exceedances in all
earlier segments. If a sensor is too quiet from the first sample on, exceedances are rare and the bound is small.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from allanite.common.arrays import Array

#: Bets on less power clip squares of whitened samples at this value (3 standard deviations). For normal samples, this
#: removes 0.5 % of the power. A larger value would limit the size of these bets.
LOW_CLIP = 9.0
#: Bets on more power clip squares at this value (5 standard deviations). They need no bound on the clipped power.
HIGH_CLIP = 25.0
#: Whitened samples whose square exceeds this value (100 standard deviations) are invalid samples.
MAX_SQUARE = 1e4
#: Distance of an upper bound from its estimate, in standard errors. A normal estimate is this far off in 0.1 % of cases.
STANDARD_ERRORS = 3.0
#: Upper 99.9 % bound on the expected number of events if none occurred: −ln 0.001.
NONE_SEEN = 6.9
#: Number of different bets per factor of e in the change of the power. A bet for a change that is 10 % off loses 1 % of its
#: growth.
LEVELS_PER_E = 5
#: Minimum factor by which one sample multiplies a bet.
MIN_FACTOR = 0.1
#: Number of factors that are multiplied before a logarithm is taken. (1 + HIGH_CLIP) to this power must not overflow.
FACTORS_PER_PRODUCT = 32


class ClippedPower:
    """Upper bound on the power that clipping removes, the mean of (w² − LOW_CLIP)₊, from the samples so far."""

    def __init__(self) -> None:
        self.samples = self.beyond = 0
        #: Sums of the excess over LOW_CLIP and of its square, then both for the excess limited to HIGH_CLIP − LOW_CLIP.
        self.sums = np.zeros(4)

    def bound(self) -> float:
        """Upper bound on the mean of max(w² − LOW_CLIP, 0) over whitened samples w; infinity before the first sample.

        It is the larger of two bounds. The first is the mean of the observed values plus three standard errors. The second
        is such a bound for w² limited to HIGH_CLIP, plus HIGH_CLIP times a bound on the share of samples with w² ≥
        HIGH_CLIP. The second bound holds if the tail falls at least as w⁻⁴.
        """
        n = self.samples
        if n == 0:
            return math.inf
        seen = _upper_mean(self.sums[0], self.sums[1], n)
        near = _upper_mean(self.sums[2], self.sums[3], n)
        count = self.beyond + STANDARD_ERRORS * math.sqrt(self.beyond) + NONE_SEEN
        return max(seen, near + HIGH_CLIP * count / n)

    def update(self, white: Array) -> None:
        """Add whitened samples to the counts and sums; their squares are first limited to `MAX_SQUARE`."""
        square = np.minimum(np.abs(white), math.sqrt(MAX_SQUARE)) ** 2
        square = square[square > LOW_CLIP]
        seen, near = square - LOW_CLIP, np.minimum(square, HIGH_CLIP) - LOW_CLIP
        self.samples += white.size
        self.beyond += int(np.count_nonzero(square >= HIGH_CLIP))
        self.sums += (seen.sum(), seen @ seen, near.sum(), near @ near)

    def state(self) -> list[float]:
        """List of six numbers for JSON, which `restore` accepts: samples, samples beyond HIGH_CLIP, and `sums`."""
        return [self.samples, self.beyond, *self.sums.tolist()]

    def restore(self, state: list[float]) -> None:
        """Set the counts and sums to those that `state()` returned."""
        samples, beyond, *sums = state
        self.samples, self.beyond = int(samples), int(beyond)
        self.sums = np.array(sums, dtype=np.float64)


def _upper_mean(total: float, squares: float, n: int) -> float:
    """Mean of n values plus three standard errors, from the sums of the values and of their squares."""
    mean = total / n
    return float(mean + STANDARD_ERRORS * math.sqrt(max(squares / n - mean**2, 0.0) / n))


class PowerBets:
    """Bets on other `levels` of the total power, each relative to that of the model, which holds within `tolerance`."""

    def __init__(self, levels: Array, tolerance: float) -> None:
        self._low, self._high = (1.0 - tolerance) ** 2, (1.0 + tolerance) ** 2
        # Levels with nearly the same change share a bet, which gains nearly as much.
        change = np.abs(levels - 1.0)
        size = np.exp(np.round(np.log(np.maximum(change, 1e-9)) * LEVELS_PER_E) / LEVELS_PER_E)
        self._levels, place = np.unique(1.0 + np.sign(levels - 1.0) * size, return_inverse=True)
        self._place = place.reshape(-1)
        self._fractions = np.array(
            [_kelly_fraction(float(level), self._low, self._high) for level in self._levels]
        )

    def gains(self, white: Array, clipped: float) -> Array:
        """Natural logarithms of the e-values of the n `levels` from one segment of whitened samples, shape (n,).

        The mean of an e-value is at most 1 if the model holds. The logarithm is 0 for levels within the tolerance, and for
        low levels that clipping alone could explain. `clipped` is an upper bound of the power that clipping at LOW_CLIP
        removes.
        """
        square = np.minimum(np.abs(white), math.sqrt(HIGH_CLIP)) ** 2
        low = self._low - clipped
        out = np.zeros(self._levels.size)
        up, down = self._levels > self._high, self._levels < low
        out[up] = _log_products(self._fractions[up], square / self._high - 1.0)
        if down.any():
            most = (1.0 - MIN_FACTOR) / (LOW_CLIP / low - 1.0)
            v = np.minimum(square, LOW_CLIP)
            out[down] = _log_products(np.maximum(self._fractions[down], -most), v / low - 1.0)
        return out[self._place]


@lru_cache(maxsize=1024)
def _kelly_fraction(level: float, low: float, high: float) -> float:
    """Fraction λ of the capital to bet on the power `level` (Kelly criterion), for normal whitened samples w.

    λ maximizes the mean of ln(1 + λ (v/m − 1)), v being w² clipped. Under the model, the mean of w² lies between `low` and
    `high`. Above `high`, m = `high` and λ ≥ 0; below `low`, m = `low` and λ ≤ 0; between them λ is 0.
    """
    from scipy.optimize import minimize_scalar
    from scipy.special import chdtri

    if low <= level <= high:
        return 0.0
    null = low if level < 1.0 else high
    sign, clip = (-1.0, LOW_CLIP) if level < 1.0 else (1.0, HIGH_CLIP)
    # The squares of 500 normal samples at evenly spaced probabilities.
    squares = chdtri(1.0, (np.arange(500) + 0.5) / 500)
    gain = np.minimum(level * squares, clip) / null - 1.0
    most = (1.0 - MIN_FACTOR) / (LOW_CLIP / null - 1.0 if level < 1.0 else 1.0)
    found = minimize_scalar(
        lambda part: -np.log1p(sign * part * gain).mean(), bounds=(0.0, most), method="bounded"
    )
    return float(sign * found.x)


def _log_products(fractions: Array, gain: Array) -> Array:
    """Array, shape (fractions,): Σ ln(1 + λ g) over the samples g of `gain`, for each λ in `fractions`."""
    factors = 1.0 + fractions[:, None] * gain
    whole = factors.shape[1] // FACTORS_PER_PRODUCT * FACTORS_PER_PRODUCT
    products = factors[:, :whole].reshape(len(fractions), -1, FACTORS_PER_PRODUCT).prod(axis=2)
    return np.asarray(np.log(products).sum(axis=1) + np.log(factors[:, whole:]).sum(axis=1))

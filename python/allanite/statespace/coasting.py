"""Sums over the samples from aiding on: exact at every length, none averaged with its neighbours.

The error is Σ r(l) x(l) over the m samples since the fix less W times the mean of the `back` samples before it, r the
weights of so many integrations and W their sum. With g(h) = ½ E(x(k+h) − x(k))² its variance is

    2 W/back Σ_l r(l) Σ_{k=1…back} g(l+k) − Σ_h c(|h|) g(|h|) − (W/back)² Σ_h (back − |h|) g(|h|),

c(h) = Σ_l r(l) r(l+h) in closed form. Sums of sums of g make each a product of two arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["Coasting", "Sums", "ramp", "turned"]

Array = NDArray[np.float64]


def ramp(m: int, rate: float, order: int) -> Array:
    """Weights of m samples integrated `order` times: (t(k) − t)^(order−1)/(order−1)! dt, exact for steps."""
    edges = (m - np.arange(m + 1)) / rate
    powers = edges**order / (1.0, 2.0, 6.0)[order - 1]
    return np.asarray(powers[:-1] - powers[1:])


def correlation(m: int, rate: float, order: int) -> Array:
    """Σ_l r(l) r(l+h) of these weights, h = 0 … m − 1; sums of powers of l + ½, all positive."""
    h = np.arange(m, dtype=float)
    u = m - h
    if order == 1:
        return np.asarray(u / rate**2)
    s1, s2 = u**2 / 2.0, u * (4.0 * u**2 - 1.0) / 12.0
    if order == 2:
        return np.asarray((s2 + h * s1) / rate**4)
    s3, s4 = u**2 * (2.0 * u**2 - 1.0) / 8.0, u * (48.0 * u**4 - 40.0 * u**2 + 7.0) / 240.0
    both = 0.25 * (s4 + 2.0 * h * s3 + h**2 * s2)
    return np.asarray((both + (2.0 * s2 + 2.0 * h * s1 + h**2 * u) / 48.0 + u / 576.0) / rate**6)


@dataclass(frozen=True, eq=False)
class Sums:
    """A variogram g(0) … g(top), and its sums.

    All weights add up to zero, so that a constant may be taken from g: without its last value, the variance of what does
    not wander, little is left to cancel.
    """

    variogram: Array

    @cached_property
    def g(self) -> Array:
        """Without its last value, shape (top + 1,)."""
        return np.asarray(self.variogram - self.variogram[-1])

    @cached_property
    def below(self) -> Array:
        """Σ g(0 … i − 1), i = 0 … top + 1."""
        return np.concatenate([[0.0], np.cumsum(self.g)])


@dataclass(frozen=True, eq=False)
class Coasting:
    """So many samples of aiding and m of coasting, integrated `order` times."""

    back: int
    m: int
    rate: float
    order: int

    @cached_property
    def weights(self) -> Array:
        """Of the samples since the fix, shape (m,)."""
        return ramp(self.m, self.rate, self.order)

    @cached_property
    def _correlation(self) -> Array:
        return correlation(self.m, self.rate, self.order)

    @cached_property
    def _mean(self) -> float:
        """Weight of each sample of aiding."""
        return float(self.weights.sum()) / self.back

    def deviation(self, sums: Sums) -> float:
        """Standard deviation of the error by noise of this variogram."""
        back, m, below = self.back, self.m, sums.below
        each = below[back + 1 : back + 1 + m] - below[1 : 1 + m]
        across = self.weights @ each
        # Distances to either side, and 0 once.
        since = 2.0 * (self._correlation @ sums.g[:m]) - self._correlation[0] * sums.g[0]
        before = 2.0 * below[: back + 1].sum() - back * sums.g[0]
        variance = 2.0 * self._mean * across - since - self._mean**2 * before
        return float(np.sqrt(max(0.0, variance)))

    def of_line(self, angle: float) -> float:
        """|Σ w(k) e^{i·angle·k}|: the largest error by a line of amplitude 1, of `angle` rad a sample."""
        aided = turned(np.ones(self.back), angle)
        since = turned(self.weights, angle) * np.exp(1j * angle * self.back)
        return float(abs(since - self._mean * aided))

    def of_signal(self, values: Array) -> float:
        """|Σ w(k) x(k)| of a known function at the samples of aiding and coasting, shape (back + m,)."""
        since = self.weights @ values[self.back : self.back + self.m]
        return float(abs(since - self._mean * values[: self.back].sum()))


def turned(weights: Array, angle: float) -> complex:
    """Σ w(k) e^{i·angle·k}, in about √n turns and n products."""
    width = max(1, int(np.sqrt(weights.size)))
    padded = np.concatenate([weights, np.zeros(-weights.size % width)]).reshape(-1, width)
    within = angle * np.arange(width)
    rows = padded @ np.cos(within) + 1j * (padded @ np.sin(within))
    return complex(rows @ np.exp(1j * angle * width * np.arange(len(padded))))

"""Exact sums over the samples from aiding on, for any length and without averaging neighbors.

The error is Σ r(l) x(l) over the m samples since the fix, less W times the mean of the `back` samples before it. r are the
weights of the repeated integration and W is their sum. With g(h) = ½ E(x(k+h) − x(k))² its variance is

    2 W/back Σ_l r(l) Σ_{k=1…back} g(l+k) − Σ_h c(|h|) g(|h|) − (W/back)² Σ_h (back − |h|) g(|h|),

with c(h) = Σ_l r(l) r(l+h) in closed form. Cumulative sums of g make each term a product of two arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from allanite.common.arrays import Array


def integration_weights(m: int, rate: float, order: int) -> Array:
    """Weights of m samples, shape (m,), whose weighted sum is their `order`-fold time integral (1 to 3), in s^order.

    Each sample is constant for 1/rate.
    """
    edges = (m - np.arange(m + 1)) / rate
    powers = edges**order / (1.0, 2.0, 6.0)[order - 1]
    return np.asarray(powers[:-1] - powers[1:])


@dataclass(frozen=True, eq=False)
class Sums:
    """Variogram g(0) … g(top) and its cumulative sums.

    All weights have the sum 0, so that a constant may be subtracted from g. Without its last value, which is the variance
    of stationary noise, little cancels.
    """

    variogram: Array

    @cached_property
    def g(self) -> Array:
        """Variogram ½ E(x(k+h) − x(k))² of the noise at the lags h = 0 … top, minus its last value, shape (top + 1,)."""
        return np.asarray(self.variogram - self.variogram[-1])

    @cached_property
    def below(self) -> Array:
        """Cumulative sums of `g`, the shifted variogram: element i is g(0) + … + g(i − 1), shape (top + 2,)."""
        return np.cumulative_sum(self.g, include_initial=True)


@dataclass(frozen=True, eq=False)
class Coasting:
    """Error after `m` samples of coasting that follow `back` samples of aiding, at `rate` Hz, integrated `order` times."""

    back: int
    m: int
    rate: float
    order: int

    @cached_property
    def weights(self) -> Array:
        """Weights w of the m samples x since the fix: their `order`-fold integral is Σ w x, in U·s^`order`. Shape (m,)."""
        return integration_weights(self.m, self.rate, self.order)

    @cached_property
    def _correlation(self) -> Array:
        """Autocorrelation Σ_l r(l) r(l+h) of `weights` r at the lags h = 0 … m − 1, in closed form, shape (m,)."""
        h, rate = np.arange(self.m, dtype=float), self.rate
        u = self.m - h
        if self.order == 1:
            return np.asarray(u / rate**2)
        s1, s2 = u**2 / 2.0, u * (4.0 * u**2 - 1.0) / 12.0
        if self.order == 2:
            return np.asarray((s2 + h * s1) / rate**4)
        s3, s4 = u**2 * (2.0 * u**2 - 1.0) / 8.0, u * (48.0 * u**4 - 40.0 * u**2 + 7.0) / 240.0
        both = 0.25 * (s4 + 2.0 * h * s3 + h**2 * s2)
        ends = (2.0 * s2 + 2.0 * h * s1 + h**2 * u) / 48.0 + u / 576.0
        return np.asarray((both + ends) / rate**6)

    @cached_property
    def _aiding_weight(self) -> float:
        """Weight of each of the `back` samples before the fix: Σ `weights` / `back`, because their mean is subtracted."""
        return float(self.weights.sum()) / self.back

    def deviation(self, sums: Sums) -> float:
        """Standard deviation of the error after coasting due to noise, in U·s^`order`; `sums` has the noise's variogram."""
        back, m, below = self.back, self.m, sums.below
        each = below[back + 1 : back + 1 + m] - below[1 : 1 + m]
        across = self.weights @ each
        # Lags of both signs, and lag 0 once.
        since = 2.0 * (self._correlation @ sums.g[:m]) - self._correlation[0] * sums.g[0]
        before = 2.0 * below[: back + 1].sum() - back * sums.g[0]
        variance = 2.0 * self._aiding_weight * across - since - self._aiding_weight**2 * before
        return float(np.sqrt(max(0.0, variance)))

    def line_error(self, angle: float) -> float:
        """Maximum error over all phases of a sinusoid with amplitude 1 and `angle` rad per sample, in U·s^`order`."""
        aided = fourier_sum(np.ones(self.back), angle)
        since = fourier_sum(self.weights, angle) * np.exp(1j * angle * self.back)
        return float(abs(since - self._aiding_weight * aided))

    def signal_error(self, values: Array) -> float:
        """Absolute error due to a known function with these samples during aiding and coasting, in U·s^`order`."""
        since = self.weights @ values[self.back : self.back + self.m]
        return float(abs(since - self._aiding_weight * values[: self.back].sum()))


def fourier_sum(weights: Array, angle: float) -> complex:
    """Complex number Σ w(k) e^{i·angle·k} for n weights w and one angle (rad), from about √n complex exponentials."""
    width = max(1, int(np.sqrt(weights.size)))
    padded = np.concatenate([weights, np.zeros(-weights.size % width)]).reshape(-1, width)
    within = angle * np.arange(width)
    rows = padded @ np.cos(within) + 1j * (padded @ np.sin(within))
    return complex(rows @ np.exp(1j * angle * width * np.arange(len(padded))))

"""Restricted likelihood and generalized least squares of samples at arbitrary times, by one Kalman filter.

The filter whitens the samples and the known functions together (`rust/kalman/stamped.rs`). Its run time grows linearly with
the number of samples. The restricted likelihood uses only combinations of samples that the known functions do not affect
(Patterson & Thompson 1971). Estimated amplitudes therefore do not bias the noise downward.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.common.arrays import Array

if TYPE_CHECKING:
    from allanite.fit.stamped.noise import StampedNoise

#: Minimum pivot of a Cholesky factor that is used. Products have a relative error of 1e-16, so that the square of this
#: pivot has a relative error of 1e-6.
MIN_PIVOT = 1e-5
#: Decay rate of the process that represents a constant, times the duration of the record: practically no decay.
CONSTANT_DECAY = 1e-9


def innovations(
    noise: StampedNoise, times: Array, observed: NDArray[np.bool_], columns: Array
) -> tuple[Array, Array]:
    """Pair of arrays: innovations of columns, shape (k, n), and their variances, shape (n,).

    An innovation is the value minus its prediction from the earlier values. Where `observed` is False, a value is only
    predicted and does not change later predictions.

    Noise that starts at 0 gives the first sample no variance. A random constant is therefore added to such noise. The
    constant among the known functions removes it again, whatever its variance.
    """
    gauss_markov = noise.gauss_markov
    if noise.white == 0.0 and all(summed for _, _, summed in gauss_markov):
        step = (times[-1] - times[0]) / max(times.size - 1, 1)
        variance = noise.walk * step + sum(v * step**2 for v, _, _ in gauss_markov)
        gauss_markov = (*gauss_markov, (variance, CONSTANT_DECAY / (times[-1] - times[0]), False))
    return _kernels.stamped_filter(times, observed, columns, gauss_markov, noise.walk, noise.white)


@dataclass(frozen=True, eq=False)
class Regressed:
    """Result of generalized least squares of k functions under one noise model.

    `log_likelihood` is restricted. `covariance` is that of the amplitudes under the given noise. `squares` is the sum of
    the squared innovations over their variances; its expectation is `freedom`, n − k.
    """

    log_likelihood: float
    amplitudes: Array
    covariance: Array
    squares: float
    freedom: int

    @property
    def scale(self) -> float:
        """Factor on the noise variance that maximizes the restricted likelihood."""
        return self.squares / self.freedom

    @property
    def profiled(self) -> float:
        """Restricted log-likelihood maximized over a factor on the noise variance."""
        return self.log_likelihood + 0.5 * (
            self.squares - self.freedom - self.freedom * float(np.log(self.scale))
        )


@dataclass(frozen=True, eq=False)
class StampedSeries:
    """Samples at non-decreasing times, s, and known functions of time, `design`, shape (k, n), including a constant."""

    times: Array
    values: Array
    design: Array

    @property
    def n(self) -> int:
        """Number of samples."""
        return self.times.size

    def regressed(self, noise: StampedNoise) -> Regressed:
        """`Regressed`: amplitudes, covariance and restricted likelihood under a noise model."""
        columns = np.vstack([self.values, self.design])
        found, variances = innovations(noise, self.times, np.ones(self.n, dtype=bool), columns)
        return self._regressed(found, variances)

    def _regressed(self, found: Array, variances: Array) -> Regressed:
        """`Regressed` from innovations, shape (1 + k, n), of the samples and functions, with their variances."""
        found = found / np.sqrt(variances)
        white, functions = found[0], found[1:]
        size = np.linalg.norm(functions, axis=1)
        lower = _factor_of_products(functions / size[:, None])
        inverse = np.linalg.inv(lower) / size
        orthonormal = inverse @ functions
        coordinates = orthonormal @ white
        squares = float(np.sum((white - coordinates @ orthonormal) ** 2))
        determinant = float(np.log(np.abs(lower.diagonal())).sum() + np.log(size).sum())
        freedom = self.n - len(self.design)
        likelihood = -0.5 * (freedom * np.log(2.0 * np.pi) + np.log(variances).sum() + squares)
        return Regressed(
            likelihood - determinant, coordinates @ inverse, inverse.T @ inverse, squares, freedom
        )

    def predicted(
        self, noise: StampedNoise, times: Array, design: Array, spreads: ArrayLike = np.inf
    ) -> tuple[Array, Array, Array]:
        """Tuple (logL, mean, variance): restricted log-likelihood, and predicted mean and variance at m later times.

        `design`, shape (k, m), are the known functions at these ascending `times`, s. `spreads` are s standard deviations
        of a normal prior of the last amplitude, with mean 0; infinite for a flat prior. The shapes are (), (m,), (m,), or
        for several spreads (s,), (s, m), (s, m).
        """
        n, m = self.n, times.size
        columns = np.zeros((1 + len(self.design), n + m))
        columns[0, :n] = self.values
        columns[1:, :n], columns[1:, n:] = self.design, design
        observed = np.arange(n + m) < n
        found, variances = innovations(
            noise, np.concatenate([self.times, times]), observed, columns
        )
        regressed = self._regressed(found[:, :n], variances[:n])
        amplitudes, covariance = regressed.amplitudes, regressed.covariance
        unexplained = found[1:, n:]
        mean = amplitudes @ unexplained - found[0, n:]
        variance = variances[n:] + np.einsum("im,ij,jm->m", unexplained, covariance, unexplained)
        # A prior is one more sample of the last amplitude: 0 with the variance of the prior.
        prior = np.asarray(spreads, dtype=np.float64) ** 2
        total, last = prior + covariance[-1, -1], amplitudes[-1]
        shared = covariance[-1] @ unexplained
        density = -0.5 * (np.log(2.0 * np.pi * total) + last**2 / total)
        likelihood = regressed.log_likelihood + np.where(np.isinf(prior), 0.0, density)
        inverse = 1.0 / total[..., None]
        return likelihood, mean - inverse * last * shared, variance - inverse * shared**2

    def last_slope(self, noise: StampedNoise, slopes: Array) -> tuple[float, float]:
        """Pair: predicted slope of the series at its last sample, and the variance of this prediction.

        It is the slope of the known functions plus the sum of the processes whose integral the samples contain. White noise
        and a random walk have no slope and are left out. `slopes`, shape (k,), are those of the known functions there.
        """
        first, last = self.times[0], self.times[-1]
        summed = [
            (variance, rate) for variance, rate, integrated in noise.gauss_markov if integrated
        ]
        # Covariance of each sample with the sum of the Gauss–Markov processes at the last sample.
        common = np.zeros(self.n)
        for variance, rate in summed:
            grown = -np.expm1(-rate * (self.times - first)) / rate
            common += variance * np.exp(-rate * (last - self.times)) * grown
        columns = np.vstack([self.values, self.design, common])
        found, variances = innovations(noise, self.times, np.ones(self.n, dtype=bool), columns)
        regressed = self._regressed(found[:-1], variances)
        found = found / np.sqrt(variances)
        white, functions, common = found[0], found[1:-1], found[-1]
        value = slopes @ regressed.amplitudes + common @ (white - regressed.amplitudes @ functions)
        unexplained = slopes - functions @ common
        known = sum(variance for variance, _ in summed) - common @ common
        return float(value), float(known + unexplained @ regressed.covariance @ unexplained)


def _factor_of_products(functions: Array) -> Array:
    """Lower triangular L, shape (k, k), for which L·Lᵀ holds the scalar products of the rows of `functions`, unit vectors.

    L is the Cholesky factor. If rows are nearly dependent, L is computed by a QR decomposition instead, which takes ten
    times as long. Diagonal elements may then be negative.
    """
    with suppress(np.linalg.LinAlgError):
        lower = np.asarray(np.linalg.cholesky(functions @ functions.T), dtype=np.float64)
        if lower.diagonal().min() > MIN_PIVOT:
            return lower
    upper: Array = np.linalg.qr(functions.T)[1]
    return upper.T

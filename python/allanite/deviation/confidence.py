"""Confidence of an estimate: equivalent degrees of freedom under a power law, and the interval from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Ratio of neighboring nodes of the sum over lags; they differ by at least 1.
NODE_RATIO = 1.06
#: (−1)^i C(2d, d+i), i = 0 … d: autocovariance of a d-th difference of white noise.
WEIGHTS = {
    2: np.array([6.0, -4.0, 1.0]),
    3: np.array([20.0, -15.0, 6.0, -1.0]),
    4: np.array([70.0, -56.0, 28.0, -8.0, 1.0]),
}


def degrees_of_freedom(
    alpha: float, m: int, count: int, *, order: int = 2, summed: bool = False, stride: int = 1
) -> float:
    """Equivalent degrees of freedom of a mean of squared differences of discrete power-law noise, at least 1.

    edf = M / (1 + 2 Σ_{j=1}^{M−1} (1 − j/M) ρ_j²), where ρ_j is the autocorrelation of the differences at lag j, and M
    is `count`. Greenhall & Riley (2003) approximate ρ by a continuous-time process. This function uses sampled noise.
    For white FM, m = 1, M = 999 and order 2, their formula gives 782 and this function 666 (2M/3). For long records the
    sum is interpolated between lags.

    Parameters
    ----------
    alpha : float
        Exponent of S_y ∝ f^α; 2 white PM, 0 white FM, −2 random-walk FM.
    m, count : int
        Averaging factor, and number of terms M.
    order : {2, 3}
        Order of the difference: Allan 2, Hadamard 3.
    summed : bool
        Phase averaged over m points, as in the modified variance.
    stride : int
        Points between terms: 1 overlapping, m not overlapping.
    """
    if count < 2:
        return 1.0
    lags = _lag_nodes(m // stride if stride > 1 else m, count, order + summed)
    rho = _autocovariance(lags * stride, alpha, m, order, summed)
    values = (1.0 - lags / count) * (rho / rho[0]) ** 2
    # Σ over the whole lags between two nodes of the straight line through them
    widths = np.diff(lags)
    total = np.sum(widths * (values[1:] + values[:-1]) / 2.0) + (values[-1] - values[0]) / 2.0
    return float(max(1.0, count / (1.0 + 2.0 * total)))


def _lag_nodes(m: int, count: int, order: int) -> NDArray[np.float64]:
    """Lags at which the terms of a sum over all lags are evaluated; between them the terms are interpolated.

    Up to 65 lags are all returned. Longer lists are dense near 0, m, … `order`·m, and end at 40 (`order` + 1) m.
    """
    farthest = min(count - 1, 40 * (order + 1) * m)
    if farthest <= 64:
        return np.arange(farthest + 1, dtype=np.float64)
    steps = np.unique(np.round(NODE_RATIO ** np.arange(np.log(farthest) / np.log(NODE_RATIO) + 1)))
    steps = np.concatenate([-steps[steps <= m][::-1], [0.0], steps])
    nodes = (m * np.arange(order + 1)[:, None] + steps).ravel()
    nodes = nodes[(nodes >= 0) & (nodes <= farthest)]
    return np.unique(np.concatenate([nodes, [float(farthest)]]))


def _autocovariance(
    lags: NDArray[np.float64], alpha: float, m: int, order: int, summed: bool
) -> NDArray[np.float64]:
    """Autocovariance of differences of the phase at each lag, up to a constant factor, shape of `lags`.

    The differences are of `order` with the step m, of the phase or, with `summed`, of its sums over m samples. The
    autocovariance is Σ_i w_i g(|lag + i m|), with the weights w of the differences and the generalized covariance g of
    the phase.
    """
    # Differences of order o exist for d < o + ½.
    d = min(max((2.0 - alpha) / 2.0, 0.0), order + 0.25) + summed
    # The sum over m samples is a difference of the integrated phase, so that it raises the order by one.
    weights = WEIGHTS[order + summed]
    total = weights[0] * _generalized_covariance(lags, d)
    for i, weight in enumerate(weights[1:], start=1):
        total += weight * (
            _generalized_covariance(lags + i * m, d)
            + _generalized_covariance(np.abs(lags - i * m), d)
        )
    return total


def _generalized_covariance(lag: NDArray[np.float64], d: float) -> NDArray[np.float64]:
    """Generalized covariance at each lag of noise with spectrum |2 sin(w/2)|^(−2d), up to a factor, shape of `lag`.

    The value is Γ(t + d)/Γ(t + 1 − d) at the lag t. For d = ½, 3/2, … this expression is an even polynomial, which
    differences remove. There the function returns the derivative of the expression with respect to d. For d below 10⁻³,
    it is 1 at lag 0 and 0 elsewhere.
    """
    from scipy.special import poch, psi

    if d < 1e-3:
        return (lag == 0).astype(np.float64)
    half = round(d - 0.5)
    if abs(d - 0.5 - half) < 1e-3:
        d = half + 0.5
        polynomial = np.ones_like(lag)
        for i in range(half):
            polynomial *= lag**2 - (i + 0.5) ** 2
        return np.asarray(polynomial * (psi(lag + d) + psi(lag + 1.0 - d)), np.float64)
    return np.asarray(poch(lag + 1.0 - d, 2.0 * d - 1.0), np.float64)


def interval(
    deviation: NDArray[np.float64], edf: NDArray[np.float64], level: float = 0.95
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ends of the confidence interval of a deviation whose square is χ² with `edf` degrees of freedom; NaN for NaN."""
    from scipy.special import gammaincinv

    tail = (1.0 - level) / 2.0
    low = deviation * np.sqrt(edf / (2.0 * gammaincinv(edf / 2.0, 1.0 - tail)))
    high = deviation * np.sqrt(edf / (2.0 * gammaincinv(edf / 2.0, tail)))
    return low, high

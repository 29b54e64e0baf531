"""Exact Cramér–Rao bound for white noise plus a random walk or a Gauss-Markov process.

First differences remove the unknown mean of the record. Their covariance is a Toeplitz matrix C(θ). The information of
their Gaussian likelihood, which a Kalman filter evaluates, is ½ tr(C⁻¹ ∂C/∂θ_a C⁻¹ ∂C/∂θ_b).
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, toeplitz


def _differences(r):
    """Autocovariance of first differences, from that of the samples r(0 … n), which may lack a constant."""
    return 2 * r[:-1] - r[1:] - np.concatenate([[r[1]], r[:-2]])


def _walk(n):
    """Autocovariance of the differences of a random walk with unit steps."""
    return np.eye(1, n, 0)[0]


def bound(model, values, n, rate):
    """Covariance of the best unbiased estimate of ln of each value, shape (p, p).

    `model` is ``N+K`` (values N, K) or ``N+GM`` (values N, q_c, T).
    """
    white = _differences(rate * np.eye(1, n, 0)[0])
    if model == "N+K":
        big_n, big_k = values
        parts = [2 * big_n**2 * white, 2 * big_k**2 / rate * _walk(n - 1)]
        total = (parts[0] + parts[1]) / 2
    else:
        big_n, q, t = values

        def markov(t):
            phi = np.exp(-1.0 / (rate * t))
            return _differences(q**2 * t / 2 * phi ** np.arange(n))

        step = 1e-4
        slope = (markov(t * np.exp(step)) - markov(t * np.exp(-step))) / (2 * step)
        parts = [2 * big_n**2 * white, 2 * markov(t), slope]
        total = (parts[0] + parts[1]) / 2
    factor = cho_factor(toeplitz(total), lower=True)
    solved = [cho_solve(factor, toeplitz(part)) for part in parts]
    return np.linalg.inv([[0.5 * np.sum(a * b.T) for b in solved] for a in solved])

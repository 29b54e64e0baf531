"""Variograms of the primitive processes, computed from their definitions, and mixtures of processes."""

import numpy as np
from scipy.special import gamma

from allanite.effects import terms


def variogram(term, count):
    """Variogram −r(h) + constant of a term for h = 0…count−1, from its definition."""
    name, v = term
    h = np.arange(count, dtype=np.longdouble)
    if name == "white":
        return -v[0] * (h == 0)
    if name == "blue":
        return -v[0] * (2.0 * (h == 0) - (h == 1))
    if name == "random_walk":
        return v[0] * h / 2
    if name == "flicker":
        steps = 1 / (2 * h[1:] - 1)
        return v[0] * 2 / np.pi * np.concatenate([[0], np.cumsum(steps)])
    if name == "power_law":
        d = -v[0] / 2
        ratio = np.concatenate([[1], np.cumprod((h[1:] - 1 + d) / (h[1:] - d))])
        return v[1] * gamma(1 - 2 * d) / gamma(1 - d) ** 2 * (1 - ratio)
    if name == "exponential":
        return -(complex(v[0], v[1]) * complex(v[2], v[3]) ** np.arange(count)).real
    return -np.pad(v, (0, count))[:count]


def summed(g):
    """The kernel, even in h, with the second difference `g`."""
    first = np.concatenate([[0], [g[0] / 2], g[0] / 2 + np.cumsum(g[1:-1])])
    return np.cumsum(first)


RESONANCE = 0.97 * np.exp(0.7j)
MIXTURES = {
    "white": [("white", [2.0])],
    "blue": [("blue", [1.5])],
    "random walk": [("random_walk", [0.3])],
    "flicker": [("flicker", [0.7])],
    "power law -0.6": [("power_law", [-0.6, 1.0])],
    "power law -1.7": [("power_law", [-1.7, 1.0])],
    "power law 0.8": [("power_law", [0.8, 1.0])],
    "gauss-markov slow": [("exponential", [1.0, 0.0, 0.9999, 0.0])],
    "gauss-markov": [("exponential", [1.0, 0.0, 0.9, 0.0])],
    "gauss-markov fast": [("exponential", [1.0, 0.0, 0.1, 0.0])],
    "alternating": [("exponential", [1.0, 0.0, -0.6, 0.0])],
    "resonance": [("exponential", [1.0, 0.2, RESONANCE.real, RESONANCE.imag])],
    "moving average": [("lags", [0.2, 0.16, 0.12, 0.08, 0.04])],
    "decimated": [
        (
            "lags",
            [
                float(r)
                for r in np.sinc(0.31 * np.arange(70)) * np.cos(np.pi * np.arange(70) / 140) ** 2
            ],
        )
    ],
    "all": [
        ("white", [1.0]),
        ("blue", [1.0]),
        ("flicker", [0.3]),
        ("random_walk", [0.01]),
        ("exponential", [0.5, 0.0, 0.95, 0.0]),
    ],
}


def term_of(name, values):
    """Term of the package from the name and the values of a term of the core."""
    if name == "exponential":
        return terms.Exponential(complex(*values[:2]), complex(*values[2:]))
    if name == "lags":
        return terms.Lags(tuple(values))
    sorts = (
        terms.White,
        terms.Blue,
        terms.RandomWalk,
        terms.Flicker,
        terms.PowerLaw,
    )
    return next(sort for sort in sorts if sort.name == name)(*values)

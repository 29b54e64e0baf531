"""Posterior of the coefficients of a noise model, as weighted points (importance sampling).

The prior is uniform in each coefficient from 0 to infinity (Gelman 2006). It is proper at 0, where the likelihood of an
effect that the record does not show is flat. Points are drawn from Student's t distributions, first around the most likely
coefficients, then with the mean and covariance of the first points. Their weights are the likelihood over the density of
all draws (Owen & Zhou 2000).

References
----------
Gelman, A. (2006). Prior distributions for variance parameters in hierarchical models. Bayesian Analysis 1, 515.
Owen, A. & Zhou, Y. (2000). Safe and effective importance sampling. J. Am. Stat. Assoc. 95, 135.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from allanite.common.arrays import Array
from allanite.common.threads import stop_if_unwanted

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.stamped.candidates import FittedNoise
    from allanite.fit.stamped.noise import StampedNoise

T = TypeVar("T")
#: Numbers of points of the first and the second draw. The half-width of a holdover band at 3 h differs by 1.3 % rms from
#: that of ten times as many points, with half as many by 4.1 % (benches/decisions/chosen_values.py posterior).
POINTS = (32, 96)
#: Degrees of freedom of the proposals: their tails are heavier than those of the posterior. A change affects only the
#: scatter of the weights: the difference above is 0.9 % with 2.5 degrees of freedom and 3.5 % with 10.
PROPOSAL_FREEDOM = 5.0
#: Range of the loss of logL, nats, at which the width of the likelihood in one coefficient is measured: that of a normal
#: likelihood at 0.7 to 1.4 standard deviations.
WIDTH_LOSS = (0.25, 1.0)
#: Maximum number of evaluations for a width. The difference above is the same with 28, and 3.4 % with 7.
MAX_WIDTH_STEPS = 14


def posterior_points(
    best: FittedNoise, evaluate: Callable[[StampedNoise], tuple[float, T]]
) -> tuple[Array, list[T]]:
    """Pair: weights of posterior points, shape (p,), with sum 1, and list of what `evaluate` returns for each point.

    A point is a set of noise coefficients, drawn by adaptive importance sampling around the fit, which must have no fitted
    exponent. `evaluate` returns the log-likelihood of a noise, and the value.
    """

    def at(coefficients: Array) -> tuple[float, T]:
        """Pair: log-likelihood of the noise with these coefficients, and the value that `evaluate` returns for it."""
        stop_if_unwanted()
        return evaluate(best.noise_of(np.abs(coefficients)))

    mean = best.coefficients
    widths = _widths(mean, lambda u: at(u)[0])
    root = np.diag(widths)
    places: Array = np.zeros((0, mean.size))
    heights: list[float] = []
    values: list[T] = []
    density = np.zeros(0)
    proposals: list[tuple[Array, Array, int]] = []
    weights = np.zeros(0)
    for count in POINTS:
        drawn = mean + _students(mean.size, count) @ root.T
        proposals.append((mean, root, count))
        places = np.vstack([places, np.abs(drawn)])
        for place in drawn:
            height, value = at(place)
            heights.append(height)
            values.append(value)
        density = np.logaddexp.reduce(
            [np.log(many) + _log_density(places, *own) for *own, many in proposals]
        )
        weights = np.exp(np.array(heights) - density - np.max(np.array(heights) - density))
        weights /= weights.sum()
        mean = weights @ places
        away = places - mean
        # Few points may lie in a subspace: a part of the first widths keeps the covariance regular.
        covariance = (away.T * weights) @ away + np.diag((0.2 * widths) ** 2)
        root = np.linalg.cholesky(covariance)
    return weights, values


def _widths(best: Array, log_likelihood: Callable[[Array], float]) -> Array:
    """Step in each coefficient alone, from `best`, that lowers logL by a quarter to one nat, shape (k,).

    A search ends after 14 steps, with the last step tried.
    """
    top = log_likelihood(best)
    low_loss, high_loss = WIDTH_LOSS
    widths = np.empty(best.size)
    for i in range(best.size):
        step = 0.1 * max(best[i], 1e-3 * float(best.max()))
        low = high = 0.0
        for _ in range(MAX_WIDTH_STEPS):
            moved = best.copy()
            moved[i] += step
            loss = top - log_likelihood(moved)
            if low_loss < loss < high_loss:
                break
            if loss >= high_loss:
                high = step
            else:
                low = step
            if low and high:
                step = float(np.sqrt(low * high))
            else:
                step *= 1.0 / 3.0 if high else 3.0
        widths[i] = step
    return widths


def _students(dimensions: int, count: int) -> Array:
    """Points of the multivariate t distribution with unit scale, from a Halton sequence, shape (count, dimensions)."""
    from scipy.special import ndtri
    from scipy.stats import chi2, qmc

    # The first point of the sequence is 0.
    uniform = qmc.Halton(dimensions + 1, scramble=False).random(count + 1)[1:]
    scale = np.sqrt(PROPOSAL_FREEDOM / chi2.ppf(uniform[:, -1], PROPOSAL_FREEDOM))
    return np.asarray(ndtri(uniform[:, :-1]) * scale[:, None])


def _log_density(places: Array, mean: Array, root: Array) -> Array:
    """Log-density of the absolute values of a Student t vector at `places`, shape (p, k), up to a constant, shape (p,).

    The vector has the center `mean` and the matrix root `root` of its scale.
    """
    k = mean.size
    parts = []
    for signs in product((1.0, -1.0), repeat=k):
        scaled = np.linalg.solve(root, (places * np.array(signs) - mean).T)
        parts.append(
            -0.5 * (PROPOSAL_FREEDOM + k) * np.log1p((scaled**2).sum(axis=0) / PROPOSAL_FREEDOM)
        )
    return np.asarray(np.logaddexp.reduce(parts) - np.log(root.diagonal()).sum())

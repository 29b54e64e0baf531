"""Intervals of slow amplitudes (ramps, steps) that include the uncertainty of the low-frequency spectrum.

The variance of a ramp or a step comes from about a dozen of the lowest ordinates. Their density is extrapolated by the
fit of K and B. With K and B fixed at their estimates the variance is too small, above all if K or B was fitted to zero.
Averaging over the coefficients (flat prior, restricted likelihood: Patterson & Thompson 1971) corrects this. The average
includes flicker noise if the model has no process that drifts slowly: such noise may be there without being detected.
The average is computed by importance sampling around the fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, scaled_inverse
from allanite.effects import Stochastic, standard
from allanite.fit.likelihood.expected import column_of, density
from allanite.fit.likelihood.whittle import information
from allanite.fit.shapes.deterministic import shape_slope
from allanite.fit.solution import Process, Regressed, Solution

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.likelihood.data import Data

#: Number of lowest ordinates that are used one by one: they hold all but a thousandth of the weight of a step.
SINGLE_ORDINATES = 1024
#: Number of draws of the coefficients in each importance sample. Chosen by judgment; not measured.
COEFFICIENT_DRAWS = 400
#: Degrees of freedom of the multivariate t of the first proposal: heavier tails than the target.
#: Chosen by judgment; not measured.
PROPOSAL_FREEDOM = 5


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Mixture of normal distributions of p amplitudes, one component for each draw of the noise coefficients.

    Shapes are (draws, p) of `means`, (draws, p, p) of `covariances` and (draws,) of `weights`, whose sum is 1.
    """

    means: Array
    covariances: Array
    weights: Array

    @property
    def variances(self) -> Array:
        """Array of the variance of each amplitude in each normal component of the mixture, shape (draws, p)."""
        return np.diagonal(self.covariances, axis1=1, axis2=2)

    def marginal(self, own: slice) -> Mixture:
        """`Mixture` of the amplitudes in the slice `own` alone (marginal distribution)."""
        return Mixture(self.means[:, own], self.covariances[:, own, own], self.weights)

    def sample(self, count: int, rng: np.random.Generator) -> Array:
        """Array of random amplitudes from the mixture, shape (count, p)."""
        size = np.sqrt(np.maximum(self.variances, 1e-300))
        strength, axes = np.linalg.eigh(self.covariances / (size[:, :, None] * size[:, None, :]))
        root = size[:, :, None] * axes * np.sqrt(np.maximum(strength, 0.0))[:, None, :]
        picked = rng.choice(self.weights.size, count, p=self.weights)
        normal = rng.standard_normal((count, self.means.shape[1]))
        return self.means[picked] + np.einsum("kij,kj->ki", root[picked], normal)

    def standard_error(self, i: int) -> float:
        """Standard deviation of amplitude i."""
        mean = self.weights @ self.means[:, i]
        spread = self.variances[:, i] + (self.means[:, i] - mean) ** 2
        return float(np.sqrt(self.weights @ spread))

    def interval(self, i: int, p: float = 0.05) -> tuple[float, float]:
        """Pair: central interval of amplitude i, which misses it with probability `p`."""
        from scipy.optimize import brentq
        from scipy.special import ndtr

        # In units of the typical spread, because `brentq` stops at an absolute tolerance.
        unit = float(np.sqrt(self.weights @ self.variances[:, i]))
        m, s = self.means[:, i] / unit, np.sqrt(self.variances[:, i]) / unit

        def quantile(p: float) -> float:
            """Quantile of the mixture at the probability `p`."""
            ends = float((m - 10.0 * s).min()), float((m + 10.0 * s).max())
            return unit * float(
                brentq(lambda x: float(self.weights @ ndtr((x - m) / s)) - p, *ends)
            )

        return quantile(0.5 * p), quantile(1.0 - 0.5 * p)


@dataclass(frozen=True, slots=True, eq=False)
class _Record:
    """Lowest ordinates one by one, and the power of the remaining bins, with the regressors of slow functions.

    `values` and `matrix`, shapes (ordinates,) and (ordinates, p), are the lowest ordinates of the record without its fast
    functions, and those of the regressors. `low` and `high`, shapes (ordinates, effects) and (bins, effects), are the
    expected power of each effect at coefficient 1 there and in the remaining bins. Of the latter, `power` is measured with
    `count` degrees of freedom.
    """

    values: Array
    matrix: Array
    low: Array
    high: Array
    power: Array
    count: Array

    def posterior(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Tuple (means, covariances, logL) of the amplitudes of slow functions for each row of noise coefficients.

        Shapes (rows, p), (rows, p, p) and (rows,). logL is the restricted log-likelihood of the coefficients.
        """
        theta = coefficients**2
        spectrum = np.maximum(theta @ self.low.T, 1e-300)
        bins = np.maximum(theta @ self.high.T, 1e-300)
        weight = 1.0 / spectrum
        normal = np.einsum("ki,dk,kj->dij", self.matrix, weight, self.matrix, optimize=True)
        score = weight @ (self.matrix * self.values[:, None])
        covariance = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
        means = np.einsum("dij,dj->di", covariance, score)
        squares = weight @ self.values**2 - np.einsum("di,di->d", score, means)
        value = -0.5 * (np.log(spectrum).sum(axis=1) + squares)
        value -= 0.5 * ((np.log(bins) + self.power / bins) @ self.count)
        value -= 0.5 * np.linalg.slogdet(normal)[1]
        return means, covariance, value


def slow_amplitudes(solution: Solution, data: Data) -> dict[Regressed, Mixture]:
    """Dict from each slow fitted function to the `Mixture` of its amplitudes, with all shapes as fitted.

    There must be at least one. Lines and other fast functions are excluded, as in `slow_values`.
    """
    slow = [own for own in solution.functions if own.effect.low]
    law = joint_amplitudes(slow, solution, data)
    ends = np.cumsum([0, *(own.amplitudes.size for own in slow)])
    parts = zip(slow, ends[:-1], ends[1:], strict=True)
    return {own: law.marginal(slice(first, last)) for own, first, last in parts}


def slow_values(solution: Solution, data: Data) -> dict[Regressed, tuple[Mixture, list[str]]]:
    """Dict from each slow fitted function to (`Mixture`, names); there must be at least one.

    The mixture is the distribution of its amplitudes and of the changes of its shapes from the fit, with the function
    linear in the shapes. `names` are those of the shapes. Shapes whose likelihood is not smooth are omitted
    (`Effect.shape_error`). Lines and other fast functions are excluded: their noise density is known from many ordinates.
    """
    slow = [own for own in solution.functions if own.effect.low]
    shapes = [_slopes(own, data) for own in slow]
    both = [
        replace(
            own,
            matrix=np.column_stack([own.matrix, *slopes.values()]),
            amplitudes=np.append(own.amplitudes, np.zeros(len(slopes))),
        )
        for own, slopes in zip(slow, shapes, strict=True)
    ]
    law = joint_amplitudes(both, solution, data)
    ends = np.cumsum([0, *(own.amplitudes.size for own in both)])
    return {
        own: (law.marginal(slice(first, last)), list(slopes))
        for own, slopes, first, last in zip(slow, shapes, ends[:-1], ends[1:], strict=True)
    }


def _slopes(own: Regressed, data: Data) -> dict[str, Array]:
    """Dict from each free shape with a smooth likelihood to the derivative of the function at the regressed ordinates.

    Shapes that cannot be changed, or whose derivative is 0 at all ordinates, are left out.
    """
    found = {
        name: shape_slope(own.effect, name, own.ordinates, data)
        for name in own.effect.free_shapes
        if own.effect.shape_error(name, float(own.covariance[0, 0]), data.duration) is None
    }
    return {name: slope for name, slope in found.items() if slope is not None and slope.any()}


def _with_flicker(solution: Solution, data: Data) -> Solution:
    """`Solution` with flicker noise of coefficient 0 added, or `solution` itself if it has a process that drifts slowly."""
    flicker = standard()["B"]()
    assert isinstance(flicker, Stochastic)
    if any(effect.wanders for effect in solution.model.stochastic):
        return solution
    added = Process(flicker, 0.0, column_of(solution.model, flicker, data))
    return replace(solution, effects=(*solution.effects, added))


def joint_amplitudes(slow: Sequence[Regressed], solution: Solution, data: Data) -> Mixture:
    """`Mixture`: joint distribution of the amplitudes of at least one slow function of time, in their order.

    It includes the uncertainty of the noise coefficients, and that of flicker noise if no slow noise was detected. Up to
    1024 of the lowest ordinates are used singly, the higher ones in bins.
    """
    solution = _with_flicker(solution, data)
    # The single ordinates end at the edge of a bin.
    first = int(np.searchsorted(data.bins.edges, min(SINGLE_ORDINATES, data.n), side="right")) - 1
    ordinates = np.arange(1, data.bins.edges[first], dtype=np.int64)
    matrix = np.hstack([own.matrix[np.searchsorted(own.ordinates, ordinates)] for own in slow])
    amplitudes = np.concatenate([own.amplitudes for own in slow])
    scale = np.maximum(np.sqrt((matrix**2).sum(axis=0)), 1e-300)
    stochastic = solution.model.stochastic
    low = np.column_stack(
        [density(data.unit_terms(solution.model, e), ordinates, data.n) for e in stochastic]
    )
    # With a discrepancy, ordinates scatter around the estimated level of the bin instead of the model.
    level = solution.level
    low *= np.repeat(level[:first], np.diff(data.bins.edges[: first + 1]))[:, None]
    record = _Record(
        solution.ordinates[ordinates] + matrix @ amplitudes,
        matrix / scale,
        low,
        solution.columns[first:] * level[first:, None],
        solution.power[first:],
        solution.weight[first:],
    )
    free = np.array([e.coefficient not in e.held for e in stochastic])
    means, covariances, weights = _sample(record, solution, free)
    return Mixture(means / scale, covariances / np.outer(scale, scale), weights)


def _sample(record: _Record, solution: Solution, free: NDArray[np.bool_]) -> tuple[Array, ...]:
    """Tuple (means, covariances, weights) of the amplitudes of slow functions, one entry for each of 400 draws.

    A draw is a set of noise coefficients, from importance sampling with a fixed seed; coefficients that are not `free`
    stay. The first proposal density is a wide multivariate t around the fit. Twice, the weighted draws are smoothed into
    the next proposal (Population Monte Carlo, Cappé et al. 2004). Coefficients may be drawn negative, because only their
    squares matter.
    """
    rng = np.random.default_rng(0)
    fitted = np.sqrt(solution.theta)
    root = _proposal(solution, free)
    steps = rng.standard_normal((COEFFICIENT_DRAWS, fitted.size))
    steps *= np.sqrt(PROPOSAL_FREEDOM / rng.chisquare(PROPOSAL_FREEDOM, COEFFICIENT_DRAWS))[:, None]
    drawn = np.where(free, fitted + steps @ root.T, fitted)
    proposed = (
        -0.5
        * (PROPOSAL_FREEDOM + fitted.size)
        * np.log1p((steps**2).sum(axis=1) / PROPOSAL_FREEDOM)
    )
    means, covariances, weights = _weighted_posterior(record, drawn, proposed)
    for _ in range(2):
        # Limit the weights so that a few heavy draws do not make the next proposal too narrow.
        share = np.minimum(weights, 4.0 / COEFFICIENT_DRAWS)
        share /= share.sum()
        centers = np.abs(drawn)
        away = (centers - share @ centers) * free
        root = 0.6 * _cholesky((away * share[:, None]).T @ away, solution)
        picked = rng.choice(COEFFICIENT_DRAWS, COEFFICIENT_DRAWS, p=share)
        drawn = centers[picked] + (rng.standard_normal(drawn.shape) @ root.T) * free
        apart = np.linalg.solve(root, (drawn[:, None] - centers).reshape(-1, fitted.size).T)
        square = (apart**2).sum(axis=0).reshape(COEFFICIENT_DRAWS, COEFFICIENT_DRAWS)
        proposed = np.log(np.maximum(np.exp(-0.5 * square) @ share, 1e-300))
        means, covariances, weights = _weighted_posterior(record, drawn, proposed)
    return means, covariances, weights


def _weighted_posterior(
    record: _Record, drawn: Array, proposed: Array
) -> tuple[Array, Array, Array]:
    """Tuple (means, covariances, weights): posterior of the amplitudes of slow functions for each row of coefficients.

    `proposed` are the logarithms of the density from which the rows `drawn` were drawn (importance sampling).
    """
    means, covariances, value = record.posterior(drawn)
    value -= proposed
    weights = np.exp(value - value.max())
    return means, covariances, weights / weights.sum()


def _cholesky(covariance: Array, solution: Solution) -> Array:
    """Array: lower Cholesky factor of a covariance of coefficients, after a small floor is added to its diagonal."""
    floor = 1e-6 * np.maximum(np.diag(covariance), 1e-12 * float(solution.theta.max()))
    return np.asarray(np.linalg.cholesky(covariance + np.diag(floor)))


def _proposal(solution: Solution, free: NDArray[np.bool_]) -> Array:
    """Lower Cholesky factor of the covariance of the first proposal distribution of coefficients, shape (p, p).

    The standard errors are 1.5 times those of the Fisher information. A coefficient whose square is below the standard
    error of this square has no correlations, and a standard error from the information on the square.
    """
    theta = solution.theta
    slopes = solution.columns / solution.spectrum[:, None]
    alone = 1.0 / np.sqrt(
        np.maximum(np.diag(information(solution.count, solution.weight, slopes)), 1e-300)
    )
    inside = free & (theta > alone)
    covariance = np.diag(np.where(free & ~inside, alone, 0.0))
    if inside.any():
        inner = information(
            solution.count, solution.weight, 2.0 * np.sqrt(theta[inside]) * slopes[:, inside]
        )
        covariance[np.ix_(inside, inside)] = scaled_inverse(inner)
    return 1.5 * _cholesky(covariance, solution)

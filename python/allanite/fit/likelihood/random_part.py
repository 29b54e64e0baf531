"""The random part of a record — power in bins — and the fit of coefficients at given shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import EVIDENCE, judge
from allanite.fit.likelihood.expected import columns, columns_like
from allanite.fit.likelihood.whittle import Maximum, climb, maximise

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data

__all__ = ["Linear", "RandomPart"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A model at given shapes: power = columns · θ, of which the held θ are known.

    Attributes
    ----------
    matrix : ndarray, shape (bins, effects)
    free : ndarray of bool, shape (effects,)
    fixed : ndarray, shape (effects,)
        Squared values of the held coefficients, 0 elsewhere.
    """

    matrix: Array
    free: NDArray[np.bool_]
    fixed: Array

    __repr__ = brief

    @property
    def offset(self) -> Array:
        """Power of the held effects, shape (bins,)."""
        return self.matrix @ self.fixed

    def whole(self, found: Maximum) -> Maximum:
        """A maximum over the free coefficients with the held ones put in."""
        theta = self.fixed.copy()
        theta[self.free] = found.theta
        return replace(found, theta=theta)


@dataclass(frozen=True, slots=True, eq=False)
class RandomPart:
    """Bin power that a model is to explain.

    Attributes
    ----------
    power, count : ndarray, shape (bins,)
        Mean squared ordinate, U² per sample, and its degrees of freedom.
    true : bool
        Whether the model is known to be the true one (a record that is expected, not measured): no discrepancy.
    """

    data: Data
    power: Array
    count: Array
    true: bool = False

    __repr__ = brief

    def linear(self, model: Model, like: tuple[Model, Linear] | None = None) -> Linear:
        """Columns at the model's present shapes; of those that are at hand what did not move is not computed anew."""
        effects = model.stochastic
        held = np.array([e.coefficient in e.held for e in effects], dtype=bool)
        known = np.array([getattr(e, e.coefficient) or 0.0 for e in effects]) ** 2
        if like is None:
            matrix = columns(model, effects, self.data)
        else:
            matrix = columns_like(model, like[0], like[1].matrix, self.data)
        return Linear(matrix, ~held, np.where(held, known, 0.0))

    def maximise(self, model: Model, start: Maximum | None = None) -> Maximum:
        """Coefficients and discrepancy at the model's present shapes, θ of all random effects; held ones stay.

        `start` is a maximum at other shapes, or of a model with one effect fewer.
        """
        linear = self.linear(model)
        free = linear.matrix[:, linear.free]
        offset = linear.offset if linear.fixed.any() else None
        if self.true:
            start_theta = np.ones(free.shape[1])
            return linear.whole(climb(self.power, self.count, free, start_theta, None, offset))
        if start is not None:
            theta = np.zeros(linear.free.size)
            theta[: start.theta.size] = start.theta[: theta.size]
            start = replace(start, theta=theta[linear.free])
        return linear.whole(maximise(self.power, self.count, free, start, offset))

    def climb(self, linear: Linear, theta: Array, scale: int | None, rounds: int = 80) -> Maximum:
        """The maximum uphill of θ."""
        return linear.whole(
            climb(
                self.power,
                self.count,
                linear.matrix[:, linear.free],
                theta[linear.free],
                scale,
                linear.offset if linear.fixed.any() else None,
                rounds,
            )
        )

    def judged(self, best: Maximum) -> float:
        """Marginal logL of a maximum on this power, less the price of a discrepancy."""
        price = EVIDENCE if best.scale is not None else 0.0
        return judge(self.power, self.count, best.spectrum, best.scale).log_likelihood - price

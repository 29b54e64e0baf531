"""Fit of the coefficients of random effects to the bin power of a record, at given shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import MIN_DISCREPANCY_DELTA_LOGL, marginal_likelihood
from allanite.fit.likelihood.expected import columns
from allanite.fit.likelihood.whittle import Maximum, climb, maximize

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A model at given shapes, linear in the squared coefficients θ: power = matrix · θ, shape (bins, effects).

    `free` is False where the coefficient is held; `fixed` are the squared values of held coefficients, 0 elsewhere.
    """

    matrix: Array
    free: NDArray[np.bool_]
    fixed: Array

    __repr__ = brief

    @property
    def offset(self) -> Array | None:
        """Array of the expected bin power of the effects whose coefficients are held, shape (bins,); None if it is 0."""
        return self.matrix @ self.fixed if self.fixed.any() else None

    def without(self, place: int) -> Linear:
        """Copy of this `Linear` without the random effect at index `place`, and without its column of bin power."""
        return Linear(
            np.delete(self.matrix, place, axis=1),
            np.delete(self.free, place),
            np.delete(self.fixed, place),
        )

    def with_held(self, found: Maximum) -> Maximum:
        """Copy of the maximum `found` with θ of all effects, shape (effects,); its θ has only the free coefficients."""
        theta = self.fixed.copy()
        theta[self.free] = found.theta
        return replace(found, theta=theta)


@dataclass(frozen=True, slots=True, eq=False)
class RandomPart:
    """Bin power of a record minus its known functions of time, to be explained by random effects.

    `power`, shape (bins,), is the mean squared ordinate, U² per sample, and `count` its degrees of freedom. With
    `is_expected`, it is computed from the model instead of measured; the discrepancy is then 0.
    """

    data: Data
    power: Array
    count: Array
    is_expected: bool = False

    __repr__ = brief

    def linear(self, model: Model) -> Linear:
        """`Linear`: expected bin power of a model, at its shapes, as a linear function of its squared coefficients."""
        effects = model.stochastic
        held = np.array([e.coefficient in e.held for e in effects], dtype=bool)
        known = np.array([getattr(e, e.coefficient) or 0.0 for e in effects]) ** 2
        return Linear(columns(model, self.data), ~held, np.where(held, known, 0.0))

    def maximize(self, model: Model, start: Maximum | None = None) -> Maximum:
        """`Maximum` of the likelihood over the free coefficients and the discrepancy, at the model's present shapes.

        `start` is a maximum at other shapes, or of the model without its last effect. θ of the result includes held
        effects.
        """
        linear = self.linear(model)
        if self.is_expected:
            return self.climb(linear, np.ones(linear.free.size), None)
        if start is not None:
            theta = np.zeros(linear.free.size)
            theta[: start.theta.size] = start.theta[: theta.size]
            start = replace(start, theta=theta[linear.free])
        free = linear.matrix[:, linear.free]
        return linear.with_held(maximize(self.power, self.count, free, start, linear.offset))

    def climb(self, linear: Linear, theta: Array, scale: int | None, rounds: int = 80) -> Maximum:
        """Local `Maximum` of the likelihood over the coefficients, by at most `rounds` ascent steps from `theta`.

        The discrepancy starts at SCALES[scale]; with None it stays 0.
        """
        return linear.with_held(
            climb(
                self.power,
                self.count,
                linear.matrix[:, linear.free],
                theta[linear.free],
                scale,
                linear.offset,
                rounds,
            )
        )

    def log_likelihood_of(self, best: Maximum) -> float:
        """Marginal logL of the spectrum of `best` for this record, minus 3 nats if its discrepancy δ is above 0."""
        price = MIN_DISCREPANCY_DELTA_LOGL if best.scale is not None else 0.0
        return marginal_likelihood(self.power, self.count, best.spectrum, best.scale)[0] - price

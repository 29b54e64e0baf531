"""Data classes of a fitted model: fitted effects, residual, and solution."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.effects import Deterministic, Effect, Model, Stochastic
from allanite.fit.likelihood.discrepancy import SCALES, bin_levels
from allanite.fit.likelihood.expected import Noise
from allanite.fit.likelihood.whittle import Maximum

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Base class of fitted effects; modifiers have no further results."""

    effect: Effect

    __repr__ = brief


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Process(Fitted):
    """A fitted random process: squared coefficient θ, and expected bin power `column` at coefficient 1, shape (bins,)."""

    effect: Stochastic
    theta: float
    column: Array

    @property
    def power(self) -> Array:
        """Array of the expected power of each bin from this random process, shape (bins,)."""
        return self.column * self.theta


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Regressed(Fitted):
    """A fitted known function of time.

    `covariance`, shape (p, p), is that of the amplitudes, with the other functions fitted too. `matrix`, shape (k, p), are
    the regressors at `ordinates`: the lowest, or those near lines. `removed` is the function removed from the residual
    ordinates; its amplitudes may differ slightly from those of `effect`.
    """

    effect: Deterministic
    amplitudes: Array
    covariance: Array
    matrix: Array
    removed: Deterministic
    ordinates: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


def fitted(
    model: Model, theta: Array, columns: Array, functions: Iterable[Regressed] = ()
) -> tuple[Fitted, ...]:
    """Tuple of the fitted effects of a model in its order: `Process`, `Regressed`, or `Fitted` for modifiers.

    `theta` are the squared coefficients of the random effects, and `columns`, shape (bins, effects), their bin power at
    coefficient 1. The elements of `functions` are used in order.
    """
    random, known = iter(zip(theta.tolist(), columns.T, strict=True)), iter(functions)
    return tuple(
        Process(effect, *next(random))
        if isinstance(effect, Stochastic)
        else next(known)
        if isinstance(effect, Deterministic)
        else Fitted(effect)
        for effect in model
    )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Residual:
    """Ordinates of a record minus the functions `removed`, computed on demand.

    The ordinates are as long as the record. Those used last are cached with the data, others are recomputed, so that a
    search with hundreds of solutions needs little memory.
    """

    data: Data
    removed: tuple[Deterministic, ...]
    _key: object = field(default_factory=object)

    @property
    def ordinates(self) -> Array:
        """Residual ordinates, shape (n,), from the cache of the data or computed again."""
        if not self.removed:
            return self.data.ordinates
        return self.data.functions.get(self._key, lambda: self.data.ordinates_without(self.removed))

    def with_cached(self, ordinates: Array) -> Residual:
        """The same `Residual`, after its already computed `ordinates` were stored in the cache of the data."""
        if self.removed:
            self.data.functions.get(self._key, lambda: ordinates)
        return self


@align_when_unpickled
@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """Result of fitting a model to data.

    Attributes
    ----------
    effects : tuple of Fitted
        Fitted effects in the order of the model.
    spectrum, weight : ndarray, shape (bins,)
        Expected bin power, and effective degrees of freedom.
    scale : int or None
        Index of the discrepancy in `discrepancy.SCALES`; None for δ = 0.
    maximum : float
        logL of the random part, less the penalty for a discrepancy.
    power : ndarray, shape (bins,)
        Measured bin power minus deterministic effects, U² per sample.
    count : ndarray, shape (bins,)
        Degrees of freedom of each bin: number of ordinates minus those used by the regression.
    log_likelihood : float
        logL of the whole record, including single ordinates near narrow bands.
    regressed_ordinates, leverage : ndarray, shape (k,)
        Ordinates in which known functions of time were regressed, and degrees of freedom that the regression used in each.
    """

    effects: tuple[Fitted, ...]
    spectrum: Array
    weight: Array
    scale: int | None
    maximum: float
    power: Array
    count: Array
    residual: Residual
    log_likelihood: float
    regressed_ordinates: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    leverage: Array = field(default_factory=lambda: np.zeros(0))

    __repr__ = brief

    @property
    def ordinates(self) -> Array:
        """Residual ordinates (coefficients of the cosine transform), without the known functions of time, shape (n,)."""
        return self.residual.ordinates

    @cached_property
    def model(self) -> Model:
        """`Model` of the effects with fitted values. Cached."""
        return Model(tuple(own.effect for own in self.effects))

    @cached_property
    def processes(self) -> tuple[Process, ...]:
        """Tuple of the fitted random processes (`Process`), in the order of the model."""
        return tuple(own for own in self.effects if isinstance(own, Process))

    @cached_property
    def functions(self) -> tuple[Regressed, ...]:
        """Tuple of the fitted known functions of time (`Regressed`), in the order of the model."""
        return tuple(own for own in self.effects if isinstance(own, Regressed))

    @cached_property
    def theta(self) -> Array:
        """Array of the squared coefficients, shape (processes,)."""
        return np.array([own.theta for own in self.processes])

    @cached_property
    def columns(self) -> Array:
        """Array of the expected power of each bin from each random process at coefficient 1, shape (bins, processes)."""
        return np.column_stack([own.column for own in self.processes])

    @property
    def best(self) -> Maximum:
        """`Maximum` of the likelihood over coefficients and discrepancy at the fitted shapes."""
        return Maximum(self.theta, self.spectrum, self.maximum, self.scale, self.weight)

    @property
    def removed_functions(self) -> tuple[Deterministic, ...]:
        """Known functions of time that were subtracted from the residual ordinates, one for each in the model.

        Their amplitudes can differ slightly from the fitted amplitudes.
        """
        return tuple(own.removed for own in self.functions)

    @property
    def level(self) -> Array:
        """Array of the estimated ratio of true to modeled power in each bin, shape (bins,); 1 without a discrepancy."""
        return bin_levels(self.power, self.count, self.spectrum, self.scale)

    @property
    def discrepancy(self) -> float:
        """Fitted model discrepancy δ of ln power; 0 if the data do not contradict the model."""
        return 0.0 if self.scale is None else float(SCALES[self.scale])

    def noise(self, data: Data) -> Noise:
        """`Noise`: predicted variance of single ordinates from the random effects, times the `level` of their bin."""
        return Noise(data.terms(self.model), data.bins, self.level)

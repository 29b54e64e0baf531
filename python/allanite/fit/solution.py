"""A fitted model: a tuple of fitted effects, each with what the fit found for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.aligned import aligned_when_unpickled
from allanite.common.showing import brief
from allanite.effects import Deterministic, Effect, Model, Stochastic
from allanite.fit.likelihood.discrepancy import SCALES, bin_levels
from allanite.fit.likelihood.expected import Noise
from allanite.fit.likelihood.whittle import Maximum

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data

__all__ = ["Fitted", "Process", "Regressed", "Residual", "Solution", "fitted", "processes_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """An effect with fitted values; of a modifier there is no more."""

    effect: Effect

    __repr__ = brief


@aligned_when_unpickled
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Process(Fitted):
    """A random process.

    Attributes
    ----------
    effect : Stochastic
    theta : float
        Squared coefficient.
    column : ndarray, shape (bins,)
        Expected bin power at coefficient 1.
    """

    effect: Stochastic
    theta: float
    column: Array

    @property
    def power(self) -> Array:
        """Expected bin power, shape (bins,)."""
        return self.column * self.theta


@aligned_when_unpickled
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Regressed(Fitted):
    """A known function of time.

    Attributes
    ----------
    effect : Deterministic
    amplitudes : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        Of the amplitudes, those of the other functions fitted with them.
    matrix : ndarray, shape (k, p)
        Its regressors in the ordinates `Solution.seen`.
    taken : Deterministic
        What was taken out of the residual ordinates: the effect to `engine.STILL` of its scatter.
    """

    effect: Deterministic
    amplitudes: Array
    covariance: Array
    matrix: Array
    taken: Deterministic


def processes_of(model: Model, theta: Array, columns: Array) -> tuple[Process, ...]:
    """The random processes of a model with fitted values, squared coefficients and columns."""
    values = zip(model.stochastic, theta.tolist(), columns.T, strict=True)
    return tuple(Process(*own) for own in values)


def fitted(
    model: Model, processes: Iterable[Process], functions: Iterable[Regressed] = ()
) -> tuple[Fitted, ...]:
    """One record an effect, in the order of the model."""
    random, known = iter(processes), iter(functions)
    return tuple(
        next(random)
        if isinstance(effect, Stochastic)
        else next(known)
        if isinstance(effect, Deterministic)
        else Fitted(effect)
        for effect in model
    )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Residual:
    """The ordinates of a record without known functions of time.

    As long as the record: those asked for last are remembered beside it, others are made again. A search that comes by
    hundreds of solutions keeps a few.

    Attributes
    ----------
    data : Data
    taken : tuple of Deterministic
        What is taken out.
    """

    data: Data
    taken: tuple[Deterministic, ...]
    _key: object = field(default_factory=object)

    @property
    def ordinates(self) -> Array:
        """Shape (n,)."""
        if not self.taken:
            return self.data.ordinates
        return self.data.functions.get(self._key, lambda: self.data.without(self.taken))

    def known(self, ordinates: Array) -> Residual:
        """Itself, with its ordinates at hand."""
        if self.taken:
            self.data.functions.get(self._key, lambda: ordinates)
        return self


@aligned_when_unpickled
@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """A fitted model with all that later steps need.

    Attributes
    ----------
    effects : tuple of Fitted
        In the order of the model.
    spectrum : ndarray, shape (bins,)
        Expected bin power.
    weight : ndarray, shape (bins,)
        Effective degrees of freedom of each bin: the vote that it had.
    scale : int or None
        Index of the scale of the discrepancy; None where the model is taken for true.
    maximum : float
        logL of the random part, less the price of a discrepancy.
    power : ndarray, shape (bins,)
        Measured bin power (deterministic effects taken out), U² per sample.
    count : ndarray, shape (bins,)
        Degrees of freedom of each bin: ordinates less what the regression used.
    residual : Residual
        Where residual ordinates come from.
    log_likelihood : float
        Of the whole record: the residual in all its ordinates.
    seen : ndarray of int64, shape (k,)
        Ordinates in which known functions of time were regressed.
    leverage : ndarray, shape (k,)
        Degrees of freedom that the regression used in each of them.
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
    seen: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    leverage: Array = field(default_factory=lambda: np.zeros(0))

    __repr__ = brief

    @property
    def ordinates(self) -> Array:
        """Residual ordinates, shape (n,)."""
        return self.residual.ordinates

    @cached_property
    def model(self) -> Model:
        """The model with fitted values."""
        return Model(tuple(own.effect for own in self.effects))

    @cached_property
    def processes(self) -> tuple[Process, ...]:
        """The random processes, in the order of the model."""
        return tuple(own for own in self.effects if isinstance(own, Process))

    @cached_property
    def functions(self) -> tuple[Regressed, ...]:
        """The known functions of time, in the order of the model."""
        return tuple(own for own in self.effects if isinstance(own, Regressed))

    @cached_property
    def theta(self) -> Array:
        """Squared coefficients, shape (processes,)."""
        return np.array([own.theta for own in self.processes])

    @cached_property
    def columns(self) -> Array:
        """Expected bin power at coefficient 1, shape (bins, processes)."""
        return np.column_stack([own.column for own in self.processes])

    @property
    def best(self) -> Maximum:
        """Where the likelihood of the random part is highest."""
        return Maximum(self.theta, self.spectrum, self.maximum, self.scale, self.weight)

    @property
    def taken(self) -> tuple[Deterministic, ...]:
        """What was taken out of the residual ordinates."""
        return tuple(own.taken for own in self.functions)

    @property
    def level(self) -> Array:
        """By how much each bin probably differs from the model, shape (bins,)."""
        return bin_levels(self.power, self.count, self.spectrum, self.scale)

    @property
    def discrepancy(self) -> float:
        """Scale of the model's misfit, of ln power; 0 where nothing speaks against the model."""
        return 0.0 if self.scale is None else float(SCALES[self.scale])

    def noise(self, data: Data) -> Noise:
        """What the random part expects of single ordinates."""
        return Noise(data.terms(self.model), data.bins, self.level)

"""Base classes of effects that follow a logged column of the recording, e.g. a temperature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._base import Effect
from allanite.effects._declared import Array, Columns, Parameter
from allanite.effects._known import Deterministic


def coefficient_parameter(unit: str, description: str) -> Parameter:
    """`Parameter` named ``coefficient``: coefficient of a column, in this `unit`, of any sign."""
    return Parameter("coefficient", unit, description, low=-np.inf, symbol="c")


def followed_column(effect: Effect, columns: Columns | None) -> Array:
    """Values of the logged column that an effect follows, shape (n,).

    Raises `InputError` if the effect names no column, or the recording has no such column.
    """
    name = effect.follows
    if name is None:
        known = ", ".join(columns or {}) or "none"
        raise InputError(
            f"{effect.kind} needs a column: write {effect.short}(column=NAME) (offered: {known})"
        )
    if columns is None or name not in columns:
        known = ", ".join(columns or {}) or "none"
        raise InputError(f"{effect.kind}: the recording has no column {name!r} (it has: {known})")
    return np.asarray(columns[name], dtype=np.float64)


@dataclass(frozen=True)
class LaggedColumn:
    """A logged column minus its mean, after a first-order lag (s), raised to a power, whose mean is subtracted again.

    `starts` has the first sample of each further run in a record of several joined logs; the lag restarts there.
    """

    column: str
    lag: float = 0.0
    power: int = 1
    starts: tuple[int, ...] = ()

    def series(self, time: Array, covariates: Columns) -> Array:
        """The column minus its mean, after a first-order low-pass, to the `power`, at each `time` (s); shape (n,)."""
        values = covariates[self.column] - np.mean(covariates[self.column])
        samples = self.lag / float(time[1] - time[0])
        if samples > 0.0:
            values = by_run(values, self.starts, lambda run: lagged(run, samples))
        if self.power == 1:
            return values
        first = values
        for _ in range(self.power - 1):
            values = values * first
        values -= values.mean()
        return values


@dataclass(frozen=True)
class Follower(Deterministic):
    """Base class of known functions of a logged column.

    Examples
    --------
    >>> first, second = al.effects.TwoLags(column="temp", fast_lag=1.0, slow_lag=9.0).sums_of_lagged()
    >>> print(second)
    ((1.0, LaggedColumn(column='temp', lag=9.0, power=1, starts=())),)
    """

    column: str | None = None

    #: First sample of each further run in a record of several joined logs; lags restart there.
    starts: tuple[int, ...] = field(default=(), compare=False, repr=False, kw_only=True)

    family = "covariate"

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """The weighted sums of `sums_of_lagged`, shape (n, regressors).

        Raises `InputError` if the recording has no such column.
        """
        followed_column(self, covariates)
        rows = [
            weighted_sum([(weight, part.series(time, covariates)) for weight, part in parts])
            for parts in self.sums_of_lagged()
        ]
        return np.array(rows).T

    def _lagged(self, lag: float | None, power: int = 1) -> LaggedColumn:
        """`LaggedColumn`: column of this effect after a low-pass of time constant `lag` (s; None is 0), to the `power`."""
        return LaggedColumn(str(self.column), lag or 0.0, power, self.starts)


def by_run(values: Array, starts: tuple[int, ...], function: Callable[[Array], Array]) -> Array:
    """Results of `function` for each joined log in `values`, one after the other, shape (n,).

    `function` has memory, such as a low-pass, which must not reach from one log into the next. `starts` are the indices
    of the first samples of all logs but the first.
    """
    if not starts:
        return function(values)
    return np.concatenate([function(run) for run in np.split(values, starts)])


def weighted_sum(parts: Sequence[tuple[float, Array]]) -> Array:
    """Array of the sum of weight · values over pairs (weight, values); one array of weight 1 is returned without a copy."""
    if len(parts) == 1 and parts[0][0] == 1.0:
        return parts[0][1]
    return np.sum([weight * values for weight, values in parts], axis=0)


def lagged(values: Array, samples: float) -> Array:
    """`values` after a first-order low-pass of gain 1 and time constant `samples`, started in equilibrium.

    If `samples` is 0, the values are returned unchanged.
    """
    from scipy.signal import lfilter

    if samples <= 0.0:
        return values
    phi = float(np.exp(-1.0 / samples))
    out, _ = lfilter([1.0 - phi], [1.0, -phi], values, zi=[phi * values[0]])
    return np.asarray(out)

"""Rate of change: the samples follow the rate of change of a logged column."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._declared import COLUMN, Array, Parameter, texts_for_clocks
from allanite.effects._follower import Follower, LaggedColumn, coefficient_parameter


@dataclass(frozen=True)
class RateOfChange(Follower):
    """x(t) = c·du/dt after a first-order lag: c·(u − lagged u)/lag, the lead of a column over a mass that follows it.

    Examples
    --------
    >>> warming = {"temperature": [20.0 + 0.1 * k for k in range(200)]}
    >>> x = al.effects.RateOfChange(column="temperature", coefficient=3.0, lag=5.0).simulate(
    ...     n=200, rate=1, seed=1, covariates=warming
    ... )
    >>> print((x.samples - x.samples[0])[[5, 199]].round(2))
    [0.17 0.27]
    """

    coefficient: float | None = None
    lag: float | None = None

    kind = "rate_of_change"
    short = "DOT"
    catalog_place = 23
    title = "rate of change"
    parameters = (
        COLUMN,
        coefficient_parameter("U·s/unit", "change of the samples per rate of change of the column"),
        Parameter("lag", "s", "time constant of the lag", "shape", low=1e-12, symbol="T"),
    )
    one_of = ("rate_of_change",)
    legend = ("coefficient", "lag")
    physics = (
        "a gradient across the sensor: while the temperature changes, one side is ahead of the other, as in a fiber coil "
        "(Shupe effect) or a structure of two materials"
    )
    looks_like = "an offset while the column rises, the opposite offset while it falls, and none while it is constant"
    check_by = "hold the column at two values: the bias is the same at both; pass from one to the other at two speeds"
    texts = texts_for_clocks(
        physics="a gradient across resonator and oven: while the temperature changes, one side is ahead of the other",
        check_by="hold the column at two values: the frequency must be equal; pass between them at two speeds",
    )
    rivals = ("covariate", "two_lags", "hysteresis", "bias_step", "warm_up", "rate_random_walk")
    refined = True

    def grid(self, name: str, n: int, rate: float) -> Array:
        """8 time constants of the low-pass on the column, s, from 1/1000 to 1/20 of the record.

        With a longer one the effect resembles the column itself. The first is at least 2 samples, the last at least 4.
        """
        return np.geomspace(max(2.0, n / 1000.0), max(4.0, n / 20.0), 8) / rate

    def sums_of_lagged(self) -> tuple[tuple[tuple[float, LaggedColumn], ...], ...]:
        """One sum of two pairs: (column − low-passed column)/lag, the slope of the low-passed column, unit/s.

        Raises `InputError` if the lag (the time constant of the low-pass) has no value or is 0.
        """
        if not self.lag:
            raise InputError(
                "rate_of_change: lag has no value; write DOT(column=NAME, lag=SECONDS)"
            )
        return (((1.0 / self.lag, self._lagged(0.0)), (-1.0 / self.lag, self._lagged(self.lag))),)

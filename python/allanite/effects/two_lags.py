"""Two lags: a logged column acts through two thermal masses with different time constants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects._declared import COLUMN, Array, Parameter, texts_for_clocks
from allanite.effects._follower import Follower, LaggedColumn


@dataclass(frozen=True)
class TwoLags(Follower):
    """x(t) = c₁·u₁(t) + c₂·u₂(t) with u₁ and u₂ a column after a short lag (0: none) and after a long lag.

    Examples
    --------
    >>> step = {"temperature": [20.0] + [21.0] * 999}
    >>> x = al.effects.TwoLags(column="temperature", fast=1.0, slow=2.0, fast_lag=0.0, slow_lag=10.0).simulate(
    ...     n=1000, rate=1, seed=1, covariates=step
    ... )
    >>> print((x.samples - x.samples[0])[[1, 10, 100]].round(2))
    [1.19 2.26 3.  ]
    """

    fast: float | None = None
    slow: float | None = None
    fast_lag: float | None = None
    slow_lag: float | None = None

    kind = "two_lags"
    short = "LAGS"
    catalog_place = 21
    title = "two lags"
    parameters = (
        COLUMN,
        Parameter("fast", "U/unit", "coefficient of the faster part", low=-np.inf, symbol="c₁"),
        Parameter("slow", "U/unit", "coefficient of the slower part", low=-np.inf, symbol="c₂"),
        Parameter("fast_lag", "s", "time constant of the faster part", "shape", symbol="T₁"),
        Parameter(
            "slow_lag", "s", "time constant of the slower part", "shape", low=1e-12, symbol="T₂"
        ),
    )
    one_of = ("covariate", "two_lags")
    legend = ("slow", "slow_lag", "fast", "fast_lag")
    physics = (
        "two thermal masses: the element warms with its package in seconds, the housing or the board in minutes, "
        "and both contribute to the bias"
    )
    looks_like = "samples over the column form a loop, wider in fast cycles; after a step of the column they keep creeping"
    check_by = (
        "step the column and hold it: two exponentials mean two masses, an immediate stop means play; put a second "
        "thermometer on the housing"
    )
    texts = texts_for_clocks(
        physics="two thermal masses: the resonator warms in seconds, the housing in minutes, and both shift the frequency"
    )
    rivals = ("covariate", "hysteresis", "rate_of_change", "rate_random_walk")
    refined = True

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Time constants of a low-pass on the column to try, s, for the parameter `name`.

        ``fast_lag``: 0 and three values up to 1/100 of the record. ``slow_lag``: six values from 1/80 to 1/5 of it.
        """
        if name == "fast_lag":
            return np.concatenate([[0.0], np.geomspace(max(1.0, n / 1600.0), n / 100.0, 3)]) / rate
        return np.geomspace(n / 80.0, n / 5.0, 6) / rate

    def sums_of_lagged(self) -> tuple[tuple[tuple[float, LaggedColumn], ...], ...]:
        """Tuple of two one-term sums: the column after the fast low-pass, and the column after the slow low-pass."""
        return tuple(((1.0, self._lagged(lag)),) for lag in (self.fast_lag, self.slow_lag))

"""Warm-up: the bias settles exponentially from power-on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import (
    Array,
    Columns,
    Parameter,
    lag_parameter,
    log_grid,
    texts_for_clocks,
)
from allanite.effects._known import Deterministic

if TYPE_CHECKING:
    from allanite.effects.model import Model


@dataclass(frozen=True)
class WarmUp(Deterministic):
    """x(t) = A e^{−t/τ} with t from the first sample.

    Examples
    --------
    >>> x = al.effects.WarmUp(time_constant=100.0, amplitude=1.0).simulate(duration=500, rate=1, seed=1).samples
    >>> print((x[100] / x[0]).round(3))
    0.368
    """

    time_constant: float | None = None
    amplitude: float | None = None

    kind = "warm_up"
    short = "WARM"
    catalog_place = 30
    common = True
    title = "warm-up"
    memoryless = True
    parameters = (
        lag_parameter("time_constant", "time constant of the settling"),
        Parameter(
            "amplitude",
            0.0,
            "deviation at the first sample",
            low=-np.inf,
            aliases=("A",),
            symbol="a",
        ),
    )
    legend = ("amplitude", "time_constant")
    physics = "the sensor heats itself after power-on, through one thermal time constant"
    looks_like = "the samples settle from the start of the record; a rise at long τ"
    check_by = "exclude the first three time constants; repeat from cold and from warm"
    texts = texts_for_clocks(
        physics="the clock heats itself after power-on, through one thermal time constant"
    )
    rivals = ("rate_ramp", "rate_random_walk", "covariate", "bias_step", "gauss_markov", "outliers")

    @classmethod
    def candidates(cls, model: Model, columns: Columns) -> tuple[Self, ...]:
        """See `Effect`. A model has at most two: a sensor and its housing settle with time constants of their own."""
        return (cls(),) if sum(effect.kind == cls.kind for effect in model) < 2 else ()

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Time constants to try, s, from two samples (a filter that started empty) to half the record; slower is a ramp."""
        return log_grid(2.0, max(n / 2.0, 4.0), 12) / rate

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of e^{−t/τ}, shape (n, 1)."""
        return np.exp(-time / (self.time_constant or 1.0))[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j of the decay of each of the `points`, shape (points, ordinates).

        They are √(2/n) e^{−start/τ} (1 − (−1)^j r^n)(1 − r) cos(a)/((1 − r)² + 4r sin²(a)) with r = e^{−1/(rate τ)}, a
        = πj/2n.
        """
        tau = np.array([p.time_constant or 1.0 for p in points])[:, None]
        a = np.pi * j / (2 * n)
        r, less = np.exp(-1.0 / (rate * tau)), -np.expm1(-1.0 / (rate * tau))
        ends = 1.0 - np.where(j % 2 == 1, -1.0, 1.0) * np.exp(-n / (rate * tau))
        shape = ends * less * np.cos(a) / (less**2 + 4.0 * r * np.sin(a) ** 2)
        return np.asarray(np.sqrt(2.0 / n) * np.exp(-start / tau) * shape)

"""Covariate: part of the samples follows a logged column through a first-order lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from allanite.effects._declared import COLUMN, Array, Columns, Parameter, texts_for_clocks
from allanite.effects._follower import Follower, LaggedColumn, coefficient_parameter

if TYPE_CHECKING:
    from allanite.effects.model import Model

#: Exponent of the column by the name of the coefficient.
_POWERS = {"coefficient": 1, "quadratic": 2, "cubic": 3}


@dataclass(frozen=True)
class Covariate(Follower):
    """x(t) = c·u(t) + d·u(t)² + e·u(t)³ with u the column minus its mean, after a lag with time constant `lag` (0: none).

    d and e are fitted only if they have a start value, e.g. 0. The temperature calibrations of PX4 (TC_*) and ArduPilot
    (INS_TCAL*) use the cubic form.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> temp = 20 + np.cumsum(rng.normal(0, 0.05, 6000))
    >>> x = rng.normal(0, 0.1, 6000) + 0.02 * temp
    >>> recording = al.Recording(x, rate=10, unit="deg/s", covariates={"temp": temp})
    >>> fit = (al.AngleRandomWalk() + al.effects.Covariate(column="temp")).fit(recording)
    >>> low, high = fit["COV.coefficient"].interval
    >>> bool(low < 0.02 < high)
    True
    """

    coefficient: float | None = None
    lag: float | None = None
    quadratic: float | None = None
    cubic: float | None = None

    kind = "covariate"
    short = "COV"
    catalog_place = 20
    common = True
    title = "logged column"
    parameters = (
        COLUMN,
        coefficient_parameter("U/unit", "change of the samples per unit of the column"),
        Parameter("lag", "s", "time constant of the lag", "shape", optional=True),
        Parameter("quadratic", "U/unit²", "quadratic coefficient", low=-np.inf, optional=True),
        Parameter("cubic", "U/unit³", "cubic coefficient", low=-np.inf, optional=True),
    )
    one_of = ("covariate", "two_lags")
    legend = ("coefficient", "lag")
    physics = (
        "the bias follows another quantity: a temperature through the sensor's thermal mass, a supply voltage, "
        "another axis by misalignment"
    )
    looks_like = "the low-passed samples trace the column; a rise of the Allan deviation at long τ"
    check_by = "drive the column on purpose (a temperature ramp up and down: a lag shows as hysteresis) and regress again"
    texts = texts_for_clocks(
        physics="the frequency follows another quantity: a temperature, a supply voltage, air pressure or humidity"
    )
    rivals = (
        "rate_random_walk",
        "rate_ramp",
        "warm_up",
        "bias_instability",
        "bias_step",
        "gauss_markov",
    )

    @classmethod
    def candidates(cls, model: Model, columns: Columns) -> tuple[Self, ...]:
        """Tuple of the linear, quadratic and cubic form for each non-constant column that the model does not follow yet."""
        plain = super().candidates(model, columns)
        forms: tuple[dict[str, float], ...] = (
            {},
            {"quadratic": 0.0},
            {"quadratic": 0.0, "cubic": 0.0},
        )
        return tuple(e.with_values(**form) for e in plain for form in forms)

    def grid(self, name: str, n: int, rate: float) -> Array:
        """13 time constants of the low-pass on the column, s: 0, and 12 values up to 1/10 of the record."""
        return np.concatenate([[0.0], np.geomspace(max(2.0, n / 2000.0), n / 10.0, 12)]) / rate

    @property
    def column_powers(self) -> tuple[int, ...]:
        """One exponent for each amplitude: (1,), (1, 2), (1, 3) or (1, 2, 3).

        The exponents 2 and 3 are present if the quadratic and the cubic coefficient have values.
        """
        return tuple(_POWERS[name] for name in self._fitted_names())

    def sums_of_lagged(self) -> tuple[tuple[tuple[float, LaggedColumn], ...], ...]:
        """Tuple of sums with one pair (1.0, `LaggedColumn`) each: the lagged column, and its square and cube if fitted."""
        return tuple(((1.0, self._lagged(self.lag, power)),) for power in self.column_powers)

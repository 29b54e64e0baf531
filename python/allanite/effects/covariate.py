"""Covariate: another column, through a first-order lag, explains part of the samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Parameter
from allanite.effects._follower import COLUMN, Follower, lagged

if TYPE_CHECKING:
    from allanite.effects.model import Model


@dataclass(frozen=True)
class Covariate(Follower):
    """x(t) = c·u(t) + d·u(t)², u the column less its mean after a lag of time constant `lag` (0: none).

    d is fitted only where a value (0 to start with) is given.

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

    kind: ClassVar[str] = "covariate"
    short: ClassVar[str] = "COV"
    title: ClassVar[str] = "covariate"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        COLUMN,
        Parameter(
            "coefficient",
            "U/unit",
            "change of the samples per unit of the column",
            low=-np.inf,
            symbol="c",
        ),
        Parameter("lag", "s", "time constant of the lag", "shape", optional=True),
        Parameter("quadratic", "U/unit²", "quadratic coefficient", low=-np.inf, optional=True),
    )
    one_of: ClassVar[tuple[str, ...]] = ("covariate", "two_lags")
    legend: ClassVar[tuple[str, ...]] = ("coefficient", "lag")
    physics: ClassVar[str] = (
        "the bias follows another quantity: a temperature through the sensor's thermal mass, a supply voltage, "
        "another axis by misalignment"
    )
    looks_like: ClassVar[str] = (
        "the low-passed samples trace the column; a rise of the Allan deviation at long τ"
    )
    check_by: ClassVar[str] = (
        "drive the column on purpose (a temperature ramp up and down: a lag shows as hysteresis) and regress again"
    )
    rivals: ClassVar[tuple[str, ...]] = (
        "rate_random_walk",
        "rate_ramp",
        "warm_up",
        "bias_instability",
        "bias_step",
        "gauss_markov",
    )

    @classmethod
    def candidates(
        cls, model: Model, columns: Mapping[str, NDArray[np.float64]]
    ) -> tuple[Self, ...]:
        """Two for each column: by a line, and by a parabola."""
        plain = super().candidates(model, columns)
        return tuple(e.with_values(quadratic=q) for e in plain for q in (None, 0.0))

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """No lag, and lags up to a tenth of the record."""
        return np.concatenate([[0.0], np.geomspace(max(2.0, n / 2000.0), n / 10.0, 12)]) / rate

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """The lagged column, and its square where a quadratic term is in the model."""
        values, rate = self._followed(time, covariates)
        values = lagged(values, (self.lag or 0.0) * rate)
        if self.quadratic is None:
            return values[:, None]
        square = values**2
        return np.column_stack([values, square - square.mean()])

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """Coefficient, and the quadratic one where it is fitted."""
        if amplitudes.size > 1:
            return self.with_values(
                coefficient=float(amplitudes[0]), quadratic=float(amplitudes[1])
            )
        return self.with_values(coefficient=float(amplitudes[0]))

    def amplitudes(self) -> NDArray[np.float64]:
        """(c,) or (c, d)."""
        first = self.coefficient or 0.0
        return np.array([first] if self.quadratic is None else [first, self.quadratic])

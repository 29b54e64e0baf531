"""Warm-up: the bias settles exponentially from power-on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Deterministic, Parameter


@dataclass(frozen=True)
class WarmUp(Deterministic):
    """x(t) = A e^{−t/τ}, t from the first sample."""

    time_constant: float | None = None
    amplitude: float | None = None

    kind: ClassVar[str] = "warm_up"
    short: ClassVar[str] = "WARM"
    title: ClassVar[str] = "warm-up"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "time_constant",
            "s",
            "time constant of the settling",
            "shape",
            low=1e-12,
            aliases=("T",),
        ),
        Parameter("amplitude", 0.0, "deviation at the first sample", low=-np.inf, aliases=("A",)),
    )
    physics: ClassVar[str] = (
        "the sensor heats itself after power-on, through one thermal time constant"
    )
    looks_like: ClassVar[str] = "the samples settle from the start of the record; a rise at long τ"
    check_by: ClassVar[str] = (
        "leave out the first three time constants; repeat from cold and from warm"
    )
    rivals: ClassVar[tuple[str, ...]] = (
        "rate_ramp",
        "rate_random_walk",
        "covariate",
        "bias_step",
        "gauss_markov",
    )

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """From a two-hundredth to a half of the record; a slower one is a ramp."""
        return np.geomspace(n / 200.0, n / 2.0, 24) / rate

    def regressors(
        self,
        time: NDArray[np.float64],
        covariates: Mapping[str, NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """One column e^{−t/τ}."""
        return np.exp(-time / (self.time_constant or 1.0))[:, None]

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """The amplitude."""
        return self.with_values(amplitude=float(amplitudes[0]))

    def amplitudes(self) -> NDArray[np.float64]:
        """(amplitude,)."""
        return np.array([self.amplitude or 0.0])

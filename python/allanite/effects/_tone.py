"""One line of an amplitude and a phase, whatever becomes of its frequency or its size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._known import Deterministic


@dataclass(frozen=True)
class Tone(Deterministic):
    """A sin(angle + φ): the subclass declares `frequency`, `amplitude` and `phase`, and what else its angle depends on."""

    family: ClassVar[str] = "line"
    low: ClassVar[bool] = False

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Its frequency at the first sample, twice."""
        f = self.values["frequency"]
        return None if f is None else (f, f)

    def _angle(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(2.0 * np.pi * (self.values["frequency"] or 0.0) * time)

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Its sine and cosine."""
        angle = self._angle(time)
        return np.column_stack([np.sin(angle), np.cos(angle)])

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → samples of the line."""
        return self._pointwise(rate, covariates)

    def amplitudes(self) -> NDArray[np.float64]:
        """(A cos φ, A sin φ)."""
        size, phase = self.values["amplitude"] or 0.0, self.values["phase"] or 0.0
        return np.array([size * np.cos(phase), size * np.sin(phase)])

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """Amplitude and phase of a sin + b cos."""
        a, b = map(float, amplitudes)
        return self.with_values(amplitude=float(np.hypot(a, b)), phase=float(np.arctan2(b, a)))

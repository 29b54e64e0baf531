"""A line: sinusoidal disturbance (IEEE 952-1997 C.1.7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Deterministic, Parameter


@dataclass(frozen=True)
class Sinusoid(Deterministic):
    """x(t) = A sin(2πft + φ); σ²(τ) = A² sin⁴(πfτ)/(m sin(πfτ0))². First peak 0.7246 A at τ = 0.371/f."""

    frequency: float | None = None
    amplitude: float | None = None
    phase: float | None = None

    kind: ClassVar[str] = "sinusoid"
    short: ClassVar[str] = "SIN"
    title: ClassVar[str] = "sinusoid"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "frequency", "Hz", "frequency of the line", "shape", low=1e-12, aliases=("f", "f0")
        ),
        Parameter("amplitude", 0.0, "amplitude (peak)", aliases=("A",)),
        Parameter("phase", "rad", "phase at the first sample: A sin(2πft + phase)", low=-np.inf),
    )
    physics: ClassVar[str] = (
        "something turns, hums or swings: a fan, the mains, a building, a pump, a dither or a clock spur"
    )
    looks_like: ClassVar[str] = (
        "a line of the spectrum; lobes of the Allan deviation with zeros at τ = k/f"
    )
    check_by: ClassVar[str] = (
        "look for a machine that runs at f or for its aliases (sample at another rate: an alias moves); "
        "repeat with the mount isolated"
    )
    rivals: ClassVar[tuple[str, ...]] = ("resonance",)

    def regressors(
        self,
        time: NDArray[np.float64],
        covariates: Mapping[str, NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Two columns: sin and cos of 2πft."""
        angle = 2.0 * np.pi * (self.frequency or 0.0) * time
        return np.column_stack([np.sin(angle), np.cos(angle)])

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """Amplitude and phase of a sin + b cos."""
        a, b = float(amplitudes[0]), float(amplitudes[1])
        return self.with_values(amplitude=float(np.hypot(a, b)), phase=float(np.arctan2(b, a)))

    def amplitudes(self) -> NDArray[np.float64]:
        """(A cos φ, A sin φ)."""
        a, phase = self.amplitude or 0.0, self.phase or 0.0
        return np.array([a * np.cos(phase), a * np.sin(phase)])

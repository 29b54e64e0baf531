"""Base class of single lines with amplitude and phase whose frequency or presence may change over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from allanite.effects._declared import Array, Columns, Parameter
from allanite.effects._known import Deterministic

#: Declaration of the amplitude of a line.
AMPLITUDE = Parameter("amplitude", 0.0, "amplitude (peak)", aliases=("A",), symbol="a")
#: Declaration of the phase of a line.
PHASE = Parameter("phase", "rad", "phase at the first sample", low=-np.inf, optional=True)


@dataclass(frozen=True)
class Tone(Deterministic):
    """A signal A sin(angle(t) + φ).

    Subclasses declare `frequency`, `amplitude`, `phase` and any further parameters of the angle.
    """

    family = "line"
    low = False
    memoryless = True

    def _angle(self, time: Array) -> Array:
        """Array of the phase angle 2πft of the line at each `time` (s), without φ, rad."""
        return np.asarray(2.0 * np.pi * (self.values["frequency"] or 0.0) * time)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of sine and cosine of the phase angle of the line at each `time`, shape (n, 2)."""
        angle = self._angle(time)
        return np.column_stack([np.sin(angle), np.cos(angle)])

    def amplitudes(self) -> Array:
        """Array (A cos φ, A sin φ), U, shape (2,); 0 for values that are None."""
        size, phase = self.values["amplitude"] or 0.0, self.values["phase"] or 0.0
        return np.array([size * np.cos(phase), size * np.sin(phase)])

    def with_amplitudes(self, amplitudes: Array) -> Self:
        """A copy with the amplitude √(a² + b²), U, and the phase atan2(b, a), rad, of a·sin + b·cos.

        `amplitudes` is the array (a, b).
        """
        a, b = map(float, amplitudes)
        return self.with_values(amplitude=float(np.hypot(a, b)), phase=float(np.arctan2(b, a)))

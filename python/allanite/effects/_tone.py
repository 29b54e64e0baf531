"""Base class of single lines with amplitude and phase whose frequency or presence may change over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from allanite.effects._declared import Array, Parameter
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

    def amplitudes(self) -> Array:
        """Array (A cos φ, A sin φ), U, shape (2,); 0 for values that are None."""
        size, phase = self.values["amplitude"] or 0.0, self.values["phase"] or 0.0
        return np.array([size * np.cos(phase), size * np.sin(phase)])

    def with_amplitudes(self, amplitudes: Array) -> Self:
        """A copy with the amplitude √(a² + b²), U, and the phase atan2(b, a), rad; a·sin + b·cos has `amplitudes` a, b."""
        a, b = map(float, amplitudes)
        return self.with_values(amplitude=float(np.hypot(a, b)), phase=float(np.arctan2(b, a)))

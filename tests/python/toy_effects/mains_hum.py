"""Mains hum: a line with a third harmonic, at one place only."""

from dataclasses import dataclass

import numpy as np

from allanite.effects import Parameter, Periodic


@dataclass(frozen=True)
class MainsHum(Periodic):
    """A sin(2πft + φ) + A₃ sin(6πft + φ₃), f near 50 Hz."""

    amplitude: float | None = None
    phase: float | None = None
    third: float | None = None
    third_phase: float | None = None

    kind = "mains_hum"
    short = "HUM"
    title = "mains hum"
    parameters = (
        Parameter("frequency", "Hz", "of the mains", "shape", low=49.0, high=51.0, symbol="f"),
        Parameter("amplitude", 0.0, "of the fundamental", symbol="a"),
        Parameter("phase", "rad", "at the first sample", low=-np.inf, optional=True),
        Parameter("third", 0.0, "amplitude of the third harmonic"),
        Parameter("third_phase", "rad", "at the first sample", low=-np.inf, optional=True),
    )
    legend = ("frequency", "amplitude")
    physics = "the mains reach the electronics"
    looks_like = "lines at 50 Hz and 150 Hz"
    check_by = "run from a battery"
    rivals = ("sinusoid",)

    @classmethod
    def at(cls, frequency, multiples):
        return cls(frequency=frequency) if abs(frequency - 50.0) < 0.5 else None

    @property
    def lines(self):
        return (
            (1, self.amplitude or 0.0, self.phase or 0.0),
            (3, self.third or 0.0, self.third_phase or 0.0),
        )

    def with_amplitudes(self, amplitudes):
        size = np.hypot(amplitudes[::2], amplitudes[1::2])
        phase = np.arctan2(amplitudes[1::2], amplitudes[::2])
        return self.with_values(
            amplitude=float(size[0]),
            phase=float(phase[0]),
            third=float(size[1]),
            third_phase=float(phase[1]),
        )

"""Drifting line: a line whose frequency changes at a constant rate, e.g. a motor that warms up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects._declared import Array, Columns, Parameter, frequency_parameter
from allanite.effects._tone import AMPLITUDE, PHASE, Tone


@dataclass(frozen=True)
class DriftingLine(Tone):
    """x(t) = A sin(2π(ft + ½dt²) + φ): `frequency` f at the first sample, `drift` d in Hz/s.

    Examples
    --------
    >>> motor = al.effects.DriftingLine(frequency=12.3, drift=0.2 / 600, amplitude=0.04)
    >>> x = (al.AngleRandomWalk(N=0.01) + motor).simulate(duration=600, rate=50, seed=1)
    >>> check = al.AngleRandomWalk().fit(x).check()
    >>> print(check.suggestions[0].kind, round(check.suggestions[0].effect.frequency, 2))
    drifting_line 12.3
    """

    frequency: float | None = None
    drift: float | None = None
    amplitude: float | None = None
    phase: float | None = None

    kind = "drifting_line"
    short = "CHIRP"
    catalog_place = 8
    title = "drifting line"
    screened = "drifting line"
    parameters = (
        frequency_parameter("frequency at the first sample"),
        Parameter("drift", "Hz/s", "rate of change of the frequency", "shape", low=-np.inf),
        AMPLITUDE,
        PHASE,
    )
    legend = ("frequency", "drift", "amplitude")
    unplanned = "it is detected like a line: plan SIN at its middle frequency"
    physics = "something turns at a changing speed: a motor or a fan that warms up, a supply that sags, a beat of clocks"
    looks_like = "a flat-topped band of the spectrum, as wide as the frequency drifts; smeared lobes of the Allan deviation"
    check_by = "log the speed or the temperature of the machine; repeat when it is warm: the band must shrink to a line"
    rivals = ("sinusoid", "resonance")

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values of the parameter `name` to try: 18 drifts, Hz/s, or frequencies, Hz, as in `Effect.grid`.

        The drifts are logarithmically spaced, from 1/T² to 256/T² and from −256/T² to −1/T², with T the duration of the
        record.
        """
        if name == "drift":
            cycles = np.geomspace(1.0, 256.0, 9)
            return np.concatenate([-cycles[::-1], cycles]) * (rate / n) ** 2
        return super().grid(name, n, rate)

    def seen_between(self, start: float, end: float) -> tuple[float, float]:
        """Pair (lowest, highest) frequency between two times (`start`, `end`, s), Hz."""
        f, d = self.frequency or 0.0, self.drift or 0.0
        ends = (f + d * start, f + d * end)
        return min(ends), max(ends)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of sine and cosine of the phase angle 2π(ft + ½dt²) of the line at each `time` (s), shape (n, 2)."""
        mean = (self.frequency or 0.0) + 0.5 * (self.drift or 0.0) * time
        angle = 2.0 * np.pi * time * mean
        return np.column_stack([np.sin(angle), np.cos(angle)])

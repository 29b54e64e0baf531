"""A line: sinusoidal disturbance (IEEE 952-1997 C.1.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from allanite.common.errors import InputError
from allanite.common.numbers import common_step
from allanite.effects._declared import Array, Parameter, frequency_parameter, texts_for_clocks
from allanite.effects._known import Periodic
from allanite.effects._tone import AMPLITUDE, PHASE


@dataclass(frozen=True)
class Sinusoid(Periodic):
    """x(t) = A sin(2πft + φ); σ²(τ) = A² sin⁴(πfτ)/(m sin(πfτ0))². First peak 0.7246 A at τ = 0.371/f.

    `overtones` lists multiple, amplitude and phase of each further line in turn: 2, A₂, φ₂, 3, A₃, φ₃ … for harmonics. For
    lines that are not harmonics, a multiple is the ratio of the line's frequency to the first one.

    References
    ----------
    IEEE 952-1997, C.1.7.

    Examples
    --------
    >>> fan = al.Sinusoid(frequency=7.3, amplitude=0.02)
    >>> x = (al.AngleRandomWalk(N=0.01) + fan).simulate(duration=60, rate=100, seed=1)
    >>> check = al.AngleRandomWalk().fit(x).check()
    >>> print(check.suggestions[0].kind, round(check.suggestions[0].effect.frequency, 1))
    sinusoid 7.3
    """

    amplitude: float | None = None
    phase: float | None = None
    overtones: tuple[float, ...] | None = None

    kind = "sinusoid"
    short = "SIN"
    catalog_place = 7
    common = True
    title = "sinusoid"
    parameters = (
        frequency_parameter("frequency of the line"),
        AMPLITUDE,
        PHASE,
        Parameter("overtones", "text", "multiple, amplitude and phase of each harmonic", "choice"),
    )
    legend = ("frequency", "amplitude")
    physics = "something turns, hums or swings: a fan, the mains, a building, a pump, a dither or a clock spur"
    looks_like = "a line of the spectrum; lobes of the Allan deviation with zeros at τ = k/f"
    check_by = (
        "look for a machine that runs at f or for its aliases (sample at another rate: an alias moves); "
        "repeat with the mount isolated"
    )
    texts = texts_for_clocks(
        physics="something modulates the frequency: day and night, an air conditioner, the mains, a spur of another clock",
        check_by="look for a cause with the period 1/f, such as room temperature; sample at another rate: an alias moves",
    )
    rivals = ("resonance",)

    def __post_init__(self) -> None:
        """Check the parameter values; InputError unless `overtones` holds triples whose first value is above 1."""
        super().__post_init__()
        given = self.overtones or ()
        if len(given) % 3 or any(m <= 1.0 for m in given[::3]):
            raise InputError(
                f"sinusoid: overtones = {given} must list multiple (above 1), amplitude and phase of each further line"
            )

    @classmethod
    def at(cls, frequency: float, multiples: Sequence[float]) -> Self:
        """New sinusoid with one line at each of the `multiples` of `frequency`, Hz; the first of the `multiples` must be 1.

        The amplitude of the first line is None (to be fitted). The amplitudes and phases of all further lines are 0.
        """
        empty = tuple(float(v) for m in multiples[1:] for v in (m, 0.0, 0.0))
        return cls(frequency=frequency, overtones=empty or None)

    @property
    def lines(self) -> tuple[tuple[float, float, float], ...]:
        """Tuple of (multiple of the frequency, amplitude, phase) of each line; the first has multiple 1."""
        rest = self.overtones or ()
        first = (1, self.amplitude or 0.0, self.phase or 0.0)
        further = zip(*(rest[i::3] for i in range(3)), strict=True)
        return (first, *((round(m) if m == round(m) else m, a, p) for m, a, p in further))

    @property
    def spaced(self) -> bool:
        """True if the effect has evenly spaced lines that are not harmonics."""
        return any(m != round(m) for m, _, _ in self.lines)

    @property
    def uneven(self) -> bool:
        """True if the lines are neither harmonics nor evenly spaced: they share no frequency."""
        return self.spaced and common_step([m for m, _, _ in self.lines]) is None

    @property
    def numbers(self) -> int:
        """Number of parameters: the frequency, two for each line, and the spacing of lines that are not harmonics.

        Lines that share no frequency have three each.
        """
        count = len(self.lines)
        return 3 * count if self.uneven else 1 + 2 * count + self.spaced

    def name_for(self, kind: str = "") -> str:
        """Display name for a `kind` of sensor; for evenly spaced lines that are not harmonics "comb of n lines".

        "n lines" for lines that share no frequency.
        """
        if not self.spaced:
            return super().name_for(kind)
        return f"{len(self.lines)} lines" if self.uneven else f"comb of {len(self.lines)} lines"

    def with_amplitudes(self, amplitudes: Array) -> Self:
        """A copy with new amplitudes and phases of the fundamental and of its overtones.

        `amplitudes` is (a₁, b₁, a₂, b₂, …): line k is aₖ·sin + bₖ·cos at its frequency. The fundamental is line 1.
        """
        size = np.hypot(amplitudes[::2], amplitudes[1::2])
        phase = np.arctan2(amplitudes[1::2], amplitudes[::2])
        rest = [
            float(v)
            for (m, _, _), a, p in zip(self.lines[1:], size[1:], phase[1:], strict=True)
            for v in (m, a, p)
        ]
        return self.with_values(
            amplitude=float(size[0]), phase=float(phase[0]), overtones=tuple(rest) or None
        )

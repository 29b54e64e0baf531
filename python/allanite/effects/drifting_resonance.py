"""Drifting resonance: a band whose frequency changes over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.effects._base import Effect
from allanite.effects._declared import Array, Parameter, texts_for_clocks
from allanite.effects._moving import Moving
from allanite.effects.resonance import Resonance, oscillations
from allanite.effects.wandering_line import WanderingLine

if TYPE_CHECKING:
    from allanite.effects.terms import Term


@dataclass(frozen=True)
class DriftingResonance(Moving):
    """A resonance that takes the frequencies of `course` in turn, in equal segments of the record.

    Strength and damping are constant. The density is the mean over the segments: r(t) = rms² Σ_k ρ_k(t)/K with ρ_k the
    correlation of a resonance at the k-th frequency.

    Examples
    --------
    >>> fan = al.effects.DriftingResonance(course=(11.0, 10.4, 10.1, 10.0), damping=0.02, rms=0.1)
    >>> fan.lowest, fan.highest, fan.numbers, len(fan.segments)
    (10.0, 11.0, 6, 4)
    >>> x = (al.AngleRandomWalk(N=0.001) + fan).simulate(duration=1000, rate=50, seed=1).samples
    >>> f = np.fft.rfftfreq(12_500, 0.02)
    >>> first, last = (f[np.argmax(np.abs(np.fft.rfft(part)))] for part in (x[:12_500], x[-12_500:]))
    >>> bool(abs(first - 11.0) < 1.0), bool(abs(last - 10.0) < 0.6)
    (True, True)
    """

    course: tuple[float, ...] | None = None
    damping: float | None = None
    rms: float | None = None

    kind = "drifting_resonance"
    short = "DRES"
    catalog_place = 15
    title = "drifting resonance"
    found_with = "resonance"
    coefficient = "rms"
    unplanned = "its evidence is the frequency of its band over time: plan a resonance as wide as its course"
    parameters = (
        Parameter(
            "course", "Hz", "natural frequency in equal segments of the record, in turn", "time"
        ),
        *Resonance.parameters[1:],
        Parameter("lowest", "Hz", "lowest frequency of the course", "derived"),
        Parameter("highest", "Hz", "highest frequency of the course", "derived"),
    )
    legend = ("lowest", "highest", "rms")
    physics = (
        "a machine whose speed changes slowly, such as a fan or a pump that warms up, or a mode of the structure whose"
        " stiffness follows the temperature"
    )
    looks_like = "a band with one steep side, wider than at any one time; a track in a spectrogram"
    check_by = (
        "look at the spectrogram; multiples of a machine's speed drift in proportion, on all axes; record again when"
        " everything is warm: the band must stay"
    )
    texts = texts_for_clocks(
        physics="a modulation whose frequency changes slowly, such as a fan or a regulator that follows the temperature",
        check_by=(
            "look at the spectrogram; compare the track with the temperature; record again when everything is "
            "warm: the band must stay"
        ),
    )

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the parameter values; InputError unless `course` has at least two positive frequencies."""
        super().__post_init__()
        if self.course is not None and (
            len(self.course) < 2 or not all(f > 0.0 for f in self.course)
        ):
            raise InputError(f"{self.kind}: course must be at least two frequencies above 0, in Hz")

    @classmethod
    def like(cls, other: Effect, **values: Any) -> Self | None:
        """Drifting resonance with the rms and half-power width of `other` and the frequencies ``course`` (Hz) of `values`.

        None if `other` is neither exactly a `Resonance` nor a `WanderingLine`.
        """
        if values.keys() != {"course"}:
            return None
        if isinstance(other, WanderingLine):
            other = other.as_resonance()
        if type(other) is not Resonance:
            return None
        return cls(damping=other.damping, rms=other.rms, **values)

    @property
    def segments(self) -> tuple[Resonance, ...]:
        """Tuple of the resonance in each equal segment of the record; empty if `course` (their frequencies) is None."""
        return tuple(
            Resonance(frequency=f, damping=self.damping, rms=self.rms) for f in self.course or ()
        )

    @property
    def middles(self) -> tuple[float, ...]:
        """Tuple of the natural frequency in each equal segment of the record, Hz; empty if `course` is None."""
        return self.course or ()

    @property
    def lowest(self) -> float | None:
        """Lowest natural frequency in `course`, which has one per segment of the record, Hz; None if `course` is None."""
        return min(self.course) if self.course else None

    @property
    def highest(self) -> float | None:
        """Highest natural frequency in `course`, which has one per segment of the record, Hz; None if `course` is None."""
        return max(self.course) if self.course else None

    @property
    def numbers(self) -> int:
        """Number of parameters: one for each frequency of the course, one for damping and one for rms."""
        return len(self.course or ()) + 2

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of six dampings from 0.001 (a narrow line) to 0.35 (a broad band)."""
        return np.array([1e-3, 3e-3, 0.01, 0.03, 0.1, 0.35])

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (low, high), Hz: f_min (1 − ζ) and f_max (1 + ζ) for damping ζ and the course f, or None."""
        if not self.course or self.damping is None:
            return None
        return min(self.course) * (1.0 - self.damping), max(self.course) * (1.0 + self.damping)

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple of one exponential for each frequency of `course`, with equal shares of a total variance of 1."""
        course = self.course or (1.0,)
        return oscillations(course, self.damping or 0.1, rate, 1.0 / len(course))

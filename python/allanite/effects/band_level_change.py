"""Noise level change of a band: for an interval the noise between two frequencies is louder or quieter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects._base import Parameter
from allanite.effects._modifier import Modifier

Stretch = NDArray[np.float64] | float


@dataclass(frozen=True)
class BandLevelChange(Modifier):
    """The noise from `low` to `high` Hz is `factor` times as strong between `start` and `end` as at other times.

    Where a process of the model has its band there (a resonance), that one is; else all noise. What the other effects say
    is the mean over the record.

    Examples
    --------
    >>> fan = al.BandLevelChange(low=2.0, high=4.0, start=50.0, end=100.0, factor=3.0)
    >>> fan.power_between(0.0, 50.0, (0.0, 100.0)), fan.power_between(50.0, 100.0, (0.0, 100.0))
    (array(0.2), array(1.8))
    >>> x = (al.AngleRandomWalk(N=0.1) + fan).simulate(duration=100, rate=10, seed=1).samples
    >>> print((x[500:].std() / x[:500].std()).round(1))
    1.4
    """

    low: float | None = None
    high: float | None = None
    start: float | None = None
    end: float | None = None
    factor: float | None = None

    kind: ClassVar[str] = "band_level_change"
    short: ClassVar[str] = "BLEVEL"
    title: ClassVar[str] = "noise level change of a band"
    screened: ClassVar[str] = "band level"
    family: ClassVar[str] = "level"
    passing: ClassVar[bool] = True
    unplanned: ClassVar[str] = (
        "its evidence is that of its band over time: plan a noise level change"
    )
    legend: ClassVar[tuple[str, ...]] = ("factor", "low", "high")
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("low", "Hz", "where the band begins", "time", symbol="from"),
        Parameter("high", "Hz", "where the band ends", "time", symbol="to"),
        Parameter("start", "s", "first time of the interval", "time"),
        Parameter("end", "s", "last time of the interval", "time"),
        Parameter("factor", "1", "standard deviation inside over outside", "time", low=1e-6),
    )
    physics: ClassVar[str] = (
        "a machine or a fan ran for a while, or faster; a mount worked loose; a filter or a range was switched"
    )
    looks_like: ClassVar[str] = (
        "nothing on the Allan curve; one octave of the map over time is louder or quieter for a while, others are not"
    )
    check_by: ClassVar[str] = (
        "look at the laboratory's log for that interval; trim it and fit again: the band is another one, all else stays"
    )
    rivals: ClassVar[tuple[str, ...]] = ("noise_level_change", "resonance", "tone_burst")

    def __post_init__(self) -> None:
        super().__post_init__()
        for first, last in (("low", "high"), ("start", "end")):
            a, b = self.values[first], self.values[last]
            if a is not None and b is not None and b <= a:
                raise InputError(f"{self.kind}: {last} = {b:g} is not above {first} = {a:g}")

    @classmethod
    def changing(cls, band: tuple[float, float], when: tuple[float, float], factor: float) -> Self:
        """The effect in this `band` (Hz) with this `factor` over an interval (s)."""
        return cls(low=band[0], high=band[1], start=when[0], end=when[1], factor=factor)

    @property
    def when(self) -> tuple[float, float] | None:
        """The interval."""
        return None if self.start is None or self.end is None else (self.start, self.end)

    @property
    def band(self) -> tuple[float, float] | None:
        """From `low` to `high`."""
        return None if self.low is None or self.high is None else (self.low, self.high)

    def power_between(
        self,
        start: Stretch,
        end: Stretch,
        span: tuple[float, float],
    ) -> NDArray[np.float64]:
        """Power of the band in each stretch over the mean of the record."""
        if self.when is None or self.factor is None:
            return np.ones(np.shape(start))
        (begin, close), more = self.when, self.factor**2 - 1.0

        def relative(low: Stretch, high: Stretch) -> NDArray[np.float64]:
            first, last = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
            inside = np.minimum(last, close) - np.maximum(first, begin)
            return np.asarray(1.0 + more * np.clip(inside, 0.0, None) / (last - first))

        return np.asarray(relative(start, end) / relative(*span))

    def errors(self, rate: float) -> dict[str, float]:
        """Standard errors of times and factor: those of a noise level change of as many values as the band has there."""
        ratio = (self.factor or 1.0) ** 2
        width = (self.high or 0.0) - (self.low or 0.0)
        values = max(1.0, 2.0 * width * ((self.end or 0.0) - (self.start or 0.0)))
        each = 0.25 * (ratio - 1.0) * (1.0 - 1.0 / ratio)
        edge = (5.5 / 1.96) / max(each, 1e-12) / max(2.0 * width, 1e-300)
        return {"start": edge, "end": edge, "factor": np.sqrt(2.034 * ratio / (2.0 * values))}

"""Noise level change: the white noise is louder or quieter during an interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from allanite.effects._declared import texts_for_clocks
from allanite.effects._level import INTERVAL, Level, interval_errors, interval_switches


@dataclass(frozen=True)
class NoiseLevelChange(Level):
    """White noise whose standard deviation is multiplied by `factor` between `start` and `end`.

    The spectrum of the record contains only the mean power; the times come from the power over time.

    Examples
    --------
    >>> louder = al.AngleRandomWalk(N=0.1) + al.effects.NoiseLevelChange(start=50.0, end=100.0, factor=2.0)
    >>> x = louder.simulate(duration=100, rate=10, seed=1).samples
    >>> print((x[500:].std() / x[:500].std()).round(0))
    2.0
    """

    start: float | None = None
    end: float | None = None
    factor: float | None = None

    kind = "noise_level_change"
    short = "LEVEL"
    catalog_place = 32
    common = True
    title = "noise level change"
    legend = ("factor",)
    parameters = INTERVAL
    interval = ("start", "end")
    physics = "for a while something shook, switched range or disturbed the supply; or the sensor lost its damping or lock"
    looks_like = "nothing on the Allan curve; a louder or quieter segment of the samples"
    check_by = "look at the laboratory's log for that interval; exclude it and fit again: everything else should stay"
    texts = texts_for_clocks(
        physics="for a while the link, the supply or the counter was noisier, or the clock lost its lock"
    )
    rivals = ("outliers", "noise_levels")

    @property
    def switches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Pair: tuple of start and end, s, and tuple of the factors after each; both are empty without values."""
        return interval_switches(self.when, self.factor)

    def switching_at(self, times: tuple[float, ...], factors: tuple[float, ...]) -> Self:
        """Copy whose interval lies between the first two `times`, s, with the first of the `factors`."""
        return self.with_values(start=times[0], end=times[1], factor=factors[0])

    def errors(self, rate: float) -> dict[str, float]:
        """Dict of the standard errors of ``start`` and ``end`` (s) and ``factor``, for white noise sampled at `rate` Hz."""
        return interval_errors(self.when, self.factor, rate)

"""Noise levels: the level of the white noise changes several times."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.effects._declared import Parameter, texts_for_clocks
from allanite.effects._level import Level


@dataclass(frozen=True)
class NoiseLevels(Level):
    """White noise whose standard deviation is N before the first of `times`, and N times one of `factors` after each.

    Repeated levels count as one parameter: a sensor that switches between two levels has one factor.

    Examples
    --------
    >>> duty = al.effects.NoiseLevels(times=(20.0, 40.0, 60.0), factors=(2.0, 1.0, 2.0))
    >>> duty.numbers, duty.changes, duty.loudest  # three times and one factor
    (4, 3.0, 2.0)
    >>> x = (al.AngleRandomWalk(N=0.1) + duty).simulate(duration=80, rate=100, seed=1).samples
    >>> print((x[2000:4000].std() / x[:2000].std()).round(1))
    2.0
    """

    times: tuple[float, ...] | None = None
    factors: tuple[float, ...] | None = None

    kind = "noise_levels"
    short = "LEVELS"
    catalog_place = 33
    title = "several noise levels"
    further = "further noise levels"
    single = True
    unplanned = "its evidence is that of the strongest interval: plan a noise level change"
    legend = ("changes", "quietest", "loudest")
    parameters = (
        Parameter("times", "s", "times of the level changes", "time"),
        Parameter(
            "factors", "1", "standard deviation after each change over that at the start", "time"
        ),
        Parameter("changes", "1", "number of changes", "derived"),
        Parameter("quietest", "1", "smallest factor", "derived"),
        Parameter("loudest", "1", "largest factor", "derived"),
    )
    physics = (
        "the sensor or something near it changes its state: a duty cycle, an automatic gain or range, a pump, a fan, "
        "people at the bench; or a coarse quantization step whose dither depends on the bias"
    )
    looks_like = "nothing on the Allan curve; segments of the samples that are louder or quieter"
    check_by = "compare the times with what was switched in the laboratory; fit the segments of one level alone"
    texts = texts_for_clocks(
        physics=(
            "the clock, its link or something near them changes its state: the load of a network, a heater, a "
            "fan, people at the bench"
        )
    )
    rivals = ("noise_level_change", "periodic_noise_level")

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the parameter values; InputError unless times increase and each has one positive factor."""
        super().__post_init__()
        if self.times is None or self.factors is None:
            return
        times, factors = self.times, self.factors
        if len(times) != len(factors):
            raise InputError(
                f"{self.kind}: found {len(times)} times and {len(factors)} factors; give one factor for each time"
            )
        if any(a >= b for a, b in pairwise(times)) or any(not f > 0.0 for f in factors):
            raise InputError(f"{self.kind}: times must increase, and factors must be above 0")

    @property
    def switches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Pair: tuple of the times of the level changes, s, and tuple of the factors after each; empty without values."""
        return self.times or (), self.factors or ()

    def switching_at(self, times: tuple[float, ...], factors: tuple[float, ...]) -> Self:
        """Copy with level changes at `times`, s, to `factors`."""
        return self.with_values(times=times, factors=factors)

    @property
    def changes(self) -> float:
        """Number of level changes, as a float; 0.0 without `times`."""
        return float(len(self.times or ()))

    @property
    def quietest(self) -> float:
        """Smallest standard deviation relative to that before the first change: the minimum of `factors` and 1."""
        return min(1.0, *(self.factors or (1.0,)))

    @property
    def loudest(self) -> float:
        """Largest standard deviation relative to that before the first change: the maximum of `factors` and 1."""
        return max(1.0, *(self.factors or (1.0,)))

    @property
    def numbers(self) -> int:
        """Number of parameters: one for each time, and one for each different factor other than 1."""
        return len(self.times or ()) + len({*(self.factors or ())} - {1.0})

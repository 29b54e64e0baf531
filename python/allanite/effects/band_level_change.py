"""Noise level change of a band: the noise between two frequencies is louder or quieter during an interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._declared import Array, Parameter, texts_for_clocks
from allanite.effects._level import INTERVAL, interval_errors, interval_switches, mean_power
from allanite.effects._modifier import Modifier


@dataclass(frozen=True)
class BandLevelChange(Modifier):
    """Noise from `low` to `high` Hz whose standard deviation is `factor` times as large between `start` and `end`.

    If a process of the model has its band there (a resonance), only this process changes, otherwise all noise. The
    coefficients of the other effects are means over the record.

    Examples
    --------
    >>> fan = al.effects.BandLevelChange(low=2.0, high=4.0, start=50.0, end=100.0, factor=3.0)
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

    kind = "band_level_change"
    short = "BLEVEL"
    catalog_place = 36
    title = "noise level change of a band"
    screened = "band level"
    family = "level"
    changes_level = True
    interval = ("start", "end")
    unplanned = "its evidence is that of its band over time: plan a noise level change"
    legend = ("factor", "low", "high")
    parameters = (
        Parameter("low", "Hz", "lower end of the band", "time", symbol="from"),
        Parameter("high", "Hz", "upper end of the band", "time", symbol="to"),
        *INTERVAL,
    )
    physics = "a machine or a fan ran for a while, or faster; a mount worked loose; a filter or a range was switched"
    looks_like = "nothing on the Allan curve; only one octave of the map over time is louder or quieter for a while"
    check_by = "look at the laboratory's log for that interval; exclude it and fit again: only the band must change"
    texts = texts_for_clocks(
        physics="a machine or a fan ran for a while, or faster; a loop or a filter changed its bandwidth"
    )
    rivals = ("noise_level_change", "resonance", "tone_burst")

    def __post_init__(self) -> None:
        """Check the parameter values; InputError unless ``low`` < ``high`` and ``start`` < ``end``."""
        super().__post_init__()
        for first, last in (("low", "high"), ("start", "end")):
            a, b = self.values[first], self.values[last]
            if a is not None and b is not None and b <= a:
                raise InputError(f"{self.kind}: {last} = {b:g} is not above {first} = {a:g}")

    @property
    def band(self) -> tuple[float, float] | None:
        """Pair (low, high) of the band, Hz; None without values."""
        return None if self.low is None or self.high is None else (self.low, self.high)

    def power_between(
        self, start: Array | float, end: Array | float, span: tuple[float, float]
    ) -> Array:
        """Mean power of the band from each `start` to each `end`, s, relative to the mean over `span`."""
        switches = interval_switches(self.when, self.factor)
        return np.asarray(mean_power(switches, start, end) / mean_power(switches, *span))

    def errors(self, rate: float) -> dict[str, float]:
        """Standard errors of ``start`` and ``end`` (s) and ``factor``, see `_level.interval_errors`.

        Noise of a band W Hz wide has 2W independent values per second, so `rate` is not used.
        """
        return interval_errors(
            self.when, self.factor, 2.0 * ((self.high or 0.0) - (self.low or 0.0))
        )

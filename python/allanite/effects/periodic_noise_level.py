"""Periodic noise level: the white noise is louder or quieter during a part of each period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from allanite.effects._declared import Array, Columns, Parameter
from allanite.effects._level import Level


@dataclass(frozen=True)
class PeriodicNoiseLevel(Level):
    """White noise of standard deviation `factor` times N's for the first `share` of every period from `start` on.

    Examples
    --------
    >>> pump = al.effects.PeriodicNoiseLevel(period=10.0, start=2.0, share=0.3, factor=2.0)
    >>> print(pump.gain(np.array([1.0, 2.5, 4.9, 5.1, 12.5])), pump.mean_power(0.0, 100.0).round(2))
    [1. 2. 2. 1. 2.] 1.9
    """

    period: float | None = None
    start: float | None = None
    share: float | None = None
    factor: float | None = None

    kind = "periodic_noise_level"
    short = "CYCLE"
    catalog_place = 34
    title = "periodic noise level"
    single = True
    unplanned = "its evidence is the power over its phase: plan a noise level change as long as all its intervals"
    legend = ("period", "factor")
    parameters = (
        Parameter("period", "s", "period of the level changes", "time", low=1e-12),
        Parameter("start", "s", "start of the first interval", "time", low=-np.inf),
        Parameter("share", "1", "length of the interval over the period", "time", high=1.0),
        Parameter("factor", "1", "standard deviation inside over outside", "time", low=1e-6),
    )
    physics = (
        "something near the sensor works periodically: the controller of a heater or cooler, a pump, a fan, a radio "
        "transmitter, a duty cycle of the supply"
    )
    looks_like = "nothing on the Allan curve; the power of the samples over the phase of the period is a gate"
    check_by = "find what runs with this period; stop it or change its duty cycle; record again"
    rivals = ("noise_levels", "noise_level_change")

    def gain(self, time: Array, columns: Columns | None = None) -> Array:
        """Array with `factor` within the intervals and 1 outside, shape (n,); ones without values."""
        if self.period is None or self.share is None or self.factor is None:
            return np.ones(time.shape)
        phase = (time - (self.start or 0.0)) / self.period
        return np.where(phase - np.floor(phase) < self.share, self.factor, 1.0)

    def mean_power(self, start: ArrayLike, end: ArrayLike, columns: Columns | None = None) -> Array:
        """Mean squared gain of each time segment: 1 + (factor² − 1) times its loud fraction; 1 without values."""
        low, high = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        if self.period is None or self.share is None or self.factor is None:
            return np.ones(low.shape)
        inside = self._time_inside_until(high) - self._time_inside_until(low)
        return np.asarray(1.0 + (self.factor**2 - 1.0) * inside / (high - low))

    def _time_inside_until(self, time: Array) -> Array:
        """Array of the total time inside the intervals from `start` to each time, s; negative before `start`."""
        assert self.period is not None
        assert self.share is not None
        phase = (time - (self.start or 0.0)) / self.period
        whole = np.floor(phase)
        return self.period * (whole * self.share + np.minimum(phase - whole, self.share))

"""Transient: the bias jumps and decays back to its level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Columns, lag_parameter, texts_for_clocks
from allanite.effects._event import HEIGHT, TIME, Event, cosines, first_samples, sines


@dataclass(frozen=True)
class Transient(Event):
    """x(t) = h e^{−(t − t0)/T} for t ≥ t0, 0 before.

    Examples
    --------
    >>> pulse = al.effects.Transient(time=50.0, time_constant=20.0, height=0.2)
    >>> x = pulse.simulate(duration=100, rate=10, seed=1).samples
    >>> print(x[[499, 500, 700]].round(3))
    [0.    0.2   0.074]
    """

    time: float | None = None
    time_constant: float | None = None
    height: float | None = None

    kind = "transient"
    short = "PULSE"
    catalog_place = 28
    title = "transient"
    family = "event"
    found_with = "bias_step"
    interval = ("time", "time")
    parameters = (TIME, lag_parameter("time_constant", "time constant of the decay"), HEIGHT)
    legend = ("height", "time", "time_constant")
    physics = "a shock, a load or a breath of warm air, after which the sensor relaxes: a bond, a filter, or a thermal mass"
    looks_like = "one steep edge in low-passed samples and an exponential return; a hump at long τ"
    check_by = "look at the samples and the laboratory's log at that time; exclude three time constants; knock and repeat"
    texts = texts_for_clocks(
        physics="a shock, a load or warm air, after which the clock relaxes: the resonator, its oven or a loop"
    )
    rivals = ("bias_step", "excursion", "warm_up", "gauss_markov")

    @property
    def when(self) -> tuple[float, float] | None:
        """Pair (time of the jump, the same time plus three time constants), s; None without values."""
        if self.time is None or self.time_constant is None:
            return None
        return self.time, self.time + 3.0 * self.time_constant

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of values to try, s: times within the record, or 20 time constants from 1/3000 to 1/4 of the record."""
        if name == "time":
            return super().grid(name, n, rate)
        return np.geomspace(n / 3000.0, n / 4.0, 20) / rate

    def shape_error(self, name: str, variance: float, duration: float) -> float | None:
        """Standard error 5.6 S/height² of the time of the jump, s; None for the time constant, whose likelihood is smooth.

        The density S of the noise follows from the `variance` of the height.
        """
        if name != "time":
            return None
        assert self.time_constant is not None
        # The energy of e^{−t/T} is that of half a time constant at full height.
        density = variance * min(0.5 * self.time_constant, duration)
        return self._edge_error(density)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """The transient at amplitude 1, shape (n, 1): 0 before the jump, then e^{−t/T} at time t after the jump."""
        after = time - (self.time or 0.0)
        decay = np.exp(-np.maximum(after, 0.0) / (self.time_constant or 1.0))
        return np.where(after >= 0.0, decay, 0.0)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j of the transient of each point at amplitude 1, shape (points, ordinates).

        The coefficients are √(2/n) Re e^{iθ(k+½)} A (1 − z^{n−k})/(1 − z). Here A is the value at the first sample k of
        the transient, z = r e^{iθ}, r = e^{−1/(rate T)} and θ = πj/n. The computed form of e^{iθ/2}/(1 − z) is ((1 − r)
        cos ½θ + i (1 + r) sin ½θ)/((1 − r)² + 4r sin² ½θ).
        """
        at = np.array([p.time or 0.0 for p in points])
        decay = np.array([p.time_constant or 1.0 for p in points])
        k = first_samples(at, n, rate, start)
        first = np.exp(-np.maximum(start + k / rate - at, 0.0) / decay)
        slope, half = 1.0 / (rate * decay), 0.5 * np.pi * j / n
        r, less = np.exp(-slope)[:, None], -np.expm1(-slope)[:, None]
        sine, cosine = np.sin(half), np.cos(half)
        # e^{iθn} = (−1)^j times the remainder of the decay at the end of the record.
        end = np.where(j % 2 == 0, 1.0, -1.0) * np.exp(-slope * (n - k))[:, None]
        found = (cosines(k, j, n) - end) * (less * cosine)
        found -= sines(k, j, n) * ((1.0 + r) * sine)
        found /= less**2 + 4.0 * r * sine**2
        found *= (np.sqrt(2.0 / n) * np.where(k < n, first, 0.0))[:, None]
        return np.asarray(found)

"""Base classes of one-time changes of the bias, with one fitted height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Parameter
from allanite.effects._known import Deterministic

#: Number of ordinates per block in `sines`: the square root of the 4096 ordinates of a search.
BLOCK_ORDINATES = 64
#: Minimum number of sines (times × ordinates) that are computed by blocks; fewer are computed one by one. Chosen by
#: judgment; not measured.
MIN_BLOCKED_SINES = 2048


#: Declaration of the time of an event with one edge.
TIME = Parameter("time", "s", "time, from the first sample", "shape", aliases=("t",), symbol="t")
#: Declaration of the height of an event.
HEIGHT = Parameter("height", 0.0, "change of the bias", low=-np.inf, aliases=("h",), symbol="h")
#: Declarations of the first and the last time of an event.
START_AND_END = (
    Parameter("start", "s", "start time, from the first sample", "shape", symbol="from"),
    Parameter("end", "s", "end time", "shape", symbol="to"),
)


@dataclass(frozen=True)
class Event(Deterministic):
    """Base class of one-time changes of the bias with one fitted `height`, U."""

    happens_once = True
    memoryless = True

    def grid(self, name: str, n: int, rate: float) -> Array:
        """At most 1024 equally spaced times within the record, s, for the times that `interval` names.

        Starts lie before a known end, ends after a known start. Other shape parameters have the default grid. If fewer
        than two times remain, the grid is 0 and the duration.
        """
        if name not in self.interval:
            return super().grid(name, n, rate)
        first, last = self.interval
        start, end = getattr(self, first), getattr(self, last)
        times = np.linspace(0.0, n / rate, 1026)[1:-1]
        if name != last and end is not None:
            times = times[times < end]
        if name != first and start is not None:
            times = times[times > start]
        return times if times.size > 1 else np.array([0.0, n / rate])

    def _edge_error(self, density: float) -> float:
        """Standard error 5.6 S/height² of the time of an edge of the event, s, in noise of two-sided `density` S, U²/Hz."""
        return edge_error(density, (self.values["height"] or 0.0) ** 2)


def edge_error(density: float, power: float) -> float:
    """Standard error 5.6 S/power of the time at which a signal of mean square `power`, U², begins or ends, s.

    S is the two-sided `density` of the noise, U²/Hz. A step h is located to ±11 S/h² with 95 % probability (Yao 1987,
    Ann. Statist. 15). The error is this half-width over 1.96, although the distribution is not normal.
    """
    return 5.6 * density / max(power, 1e-300)


@dataclass(frozen=True)
class Away(Event):
    """Base class of events in which the bias leaves its level and returns, once or several times.

    Examples
    --------
    >>> once = al.effects.Excursion(start=20.0, end=60.0, height=0.2)
    >>> twice = al.effects.Excursions.together([al.effects.Excursion(start=80.0, end=90.0, height=-0.1), once])
    >>> [e.start for e in twice.singly], once.singly == (once,), al.effects.Excursion.together([once])
    ([20.0, 80.0], True, None)
    """

    family = "event"
    returns = True


def step_ordinates(times: Array, j: NDArray[np.int64], n: int, rate: float, start: float) -> Array:
    """Cosine-transform coefficients j of steps from 0 to 1 at `times`, s, shape (times.size, j.size).

    A step at sample k has −√(2/n) sin(πjk/n)/(2 sin(πj/2n)). `start` is the time of the first of n samples at `rate`
    Hz, s.
    """
    found = sines(first_samples(times, n, rate, start), j, n)
    found *= -np.sqrt(0.5 / n) / np.sin(np.pi * j / (2 * n))
    return found


def first_samples(times: Array, n: int, rate: float, start: float) -> Array:
    """Array of the index (0 to n, as float) of the first sample at or after each time, s; sample 0 is at `start`."""
    return np.clip(np.ceil((times - start) * rate - 1e-9), 0, n)


def cosines(k: Array, j: NDArray[np.int64], n: int) -> Array:
    """Array of cos(πjk/n) for samples k and indices j of cosine-transform coefficients, shape (k.size, j.size)."""
    return sines(k, j, n, 0.5 * np.pi)


def sines(k: Array, j: NDArray[np.int64], n: int, phase: float = 0.0) -> Array:
    """sin(πjk/n + phase) for samples k and indices j of cosine-transform coefficients, shape (k.size, j.size).

    Many values at successive j are computed by blocks with sin(a + b), since a search needs millions of them.
    """
    if k.size * j.size < MIN_BLOCKED_SINES or j[-1] - j[0] + 1 != j.size:
        return np.asarray(np.sin(np.pi * j * k[:, None] / n + phase))
    turn = np.pi / n * k[:, None]
    coarse = turn * (j[0] + BLOCK_ORDINATES * np.arange(-(-j.size // BLOCK_ORDINATES))) + phase
    fine = turn * np.arange(BLOCK_ORDINATES)
    left = np.stack([np.sin(coarse), np.cos(coarse)], axis=-1)
    right = np.stack([np.cos(fine), np.sin(fine)], axis=-2)
    return np.asarray((left @ right).reshape(k.size, -1)[:, : j.size])

"""Excursion: the bias leaves its level for a while and returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Columns, texts_for_clocks
from allanite.effects._event import HEIGHT, START_AND_END, Away, Event, step_ordinates
from allanite.effects.transient import Transient


@dataclass(frozen=True)
class Excursion(Away):
    """x(t) = h for start ≤ t < end, otherwise 0.

    Examples
    --------
    >>> away = al.effects.Excursion(start=20.0, end=60.0, height=0.2)
    >>> x = (al.AngleRandomWalk(N=0.01) + away).simulate(duration=100, rate=10, seed=1).samples
    >>> print((x[200:600].mean() - x[600:].mean()).round(1))
    0.2
    """

    start: float | None = None
    end: float | None = None
    height: float | None = None

    kind = "excursion"
    short = "EXC"
    catalog_place = 25
    title = "excursion"
    found_with = "bias_step"
    interval = ("start", "end")
    parameters = (*START_AND_END, HEIGHT)
    legend = ("height", "start", "end")
    physics = "something acted for a while: someone leaned on the mount, a machine ran, the supply sagged, the sun shone"
    looks_like = "low-passed samples stay at another level between two edges; a hump at long τ"
    check_by = "look at the samples and at the laboratory's log at those times; exclude the segment; repeat the record"
    texts = texts_for_clocks(
        physics="something acted for a while: a heater or the sun, a supply that sagged, or another reference"
    )
    rivals = ("excursions", "bias_step", "transient", "burst_noise", "gauss_markov")

    def extended(self) -> tuple[Event, ...]:
        """Tuple with one transient, which jumps where the excursion starts and then decays back; empty without a start."""
        return () if self.start is None else (Transient(time=self.start),)

    def shape_error(self, name: str, variance: float, duration: float) -> float:
        """Standard error 5.6 S/height² of the start or the end, s.

        The density S of the noise follows from the `variance` S·T/(l(T − l)) of the height of an excursion of length l
        in a record of `duration` T. The length counts as at least 0.1 % and at most 99.9 % of T.
        """
        assert self.start is not None
        assert self.end is not None
        length = min(max(self.end - self.start, 1e-3 * duration), 0.999 * duration)
        density = variance * length * (duration - length) / duration
        return self._edge_error(density)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array with 1 for start ≤ t < end and 0 outside, shape (n, 1)."""
        inside = (time >= (self.start or 0.0)) & (time < (self.end or 0.0))
        return inside.astype(float)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j, shape (points, ordinates): a step at the start minus one at the end."""
        edges = np.array([(p.start or 0.0, p.end or 0.0) for p in points])
        known, place = np.unique(edges, return_inverse=True)  # many points share an edge
        steps = step_ordinates(known, j, n, rate, start)
        place = place.reshape(edges.shape)
        found = steps[place[:, 0]]
        for at, after in enumerate(place[:, 1]):
            found[at] -= steps[after]
        return found

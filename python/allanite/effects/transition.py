"""Transition: the bias changes linearly from one level to another between two times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Columns, Parameter, texts_for_clocks
from allanite.effects._event import HEIGHT, Event, cosines, sines

#: Minimum duration of a transition, in samples, in the closed form of its ordinates. Shorter transitions are computed with
#: this duration, which acts as a step.
MIN_TRANSITION_SAMPLES = 1e-6


@dataclass(frozen=True)
class Transition(Event):
    """x(t) = 0 before `begin`, h (t − begin)/(end − begin) until `end`, then h.

    Examples
    --------
    >>> rise = al.effects.Transition(begin=20.0, end=60.0, height=0.2)
    >>> x = (al.AngleRandomWalk(N=0.01) + rise).simulate(duration=100, rate=10, seed=1).samples
    >>> print((x[600:].mean() - x[:200].mean()).round(1))
    0.2
    """

    begin: float | None = None
    end: float | None = None
    height: float | None = None

    kind = "transition"
    short = "RISE"
    catalog_place = 29
    title = "transition"
    family = "transition"
    lasting = True
    found_with = "bias_step"
    interval = ("begin", "end")
    parameters = (
        Parameter("begin", "s", "start time, from the first sample", "shape", symbol="from"),
        Parameter("end", "s", "end time", "shape", symbol="to"),
        HEIGHT,
    )
    legend = ("height", "begin", "end")
    physics = "the surroundings changed from one state to another: a heater, a window, the sun, or a mount that relaxed"
    looks_like = "the low-passed samples stay at one level, change for a while, and stay at another level; a hump at long τ"
    check_by = "look at the samples and at the laboratory's log between these times; log the temperature; repeat the record"
    texts = texts_for_clocks(
        physics="the surroundings changed from one state to another: a heater, a window, the sun, or another reference"
    )
    rivals = ("bias_step", "rate_random_walk", "rate_ramp", "warm_up", "covariate", "gauss_markov")

    def _edges(self) -> tuple[float, float]:
        """Pair (begin, end), s; a missing begin is 0, and a missing or earlier end equals the begin."""
        begin = self.begin or 0.0
        return begin, max(begin if self.end is None else self.end, begin)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of the linear rise from 0 at `begin` to 1 at `end`, shape (n, 1); a step if both are equal."""
        begin, end = self._edges()
        if end == begin:
            return (time > begin).astype(float)[:, None]
        return np.clip((time - begin) / (end - begin), 0.0, 1.0)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j of the transition of each of the `points`, shape (points, ordinates).

        A transition from k to l, in samples, has (h(k) − h(l))/(l − k), with h(k) the transform of max(i − k, 0). Here
        k and l may be fractions. With m the first sample after k, max(i − k, 0) is a step of m − k at m and a step of 1
        at each later sample. With a = πj/2n, h(k) is −√(1/2n) ((m − k) sin 2am + cos a(2m + 1)/(2 sin a))/sin a, plus a
        part independent of k.
        """
        edges = (np.array([p._edges() for p in points]) - start) * rate
        edges[:, 1] = np.maximum(edges[:, 1], edges[:, 0] + MIN_TRANSITION_SAMPLES)
        known, place = np.unique(edges, return_inverse=True)  # many points share an edge
        place = place.reshape(edges.shape)
        m = np.clip(np.floor(known) + 1.0, 0.0, n)
        sine = np.sin(np.pi * j / (2 * n))
        hinge = cosines(m + 0.5, j, n) / (2.0 * sine)
        hinge += sines(m, j, n) * np.where(known < n, m - known, 0.0)[:, None]
        hinge *= -np.sqrt(0.5 / n) / sine
        found = hinge[place[:, 0]] - hinge[place[:, 1]]
        found /= (edges[:, 1] - edges[:, 0])[:, None]
        return np.asarray(found)

"""Several excursions: the bias leaves its level several times and returns each time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.effects._declared import Array, Columns, Parameter
from allanite.effects._event import Away
from allanite.effects.excursion import Excursion

if TYPE_CHECKING:
    from allanite.effects._known import Deterministic

#: Minimum net height where excursions overlap, relative to the largest height of these excursions. With a smaller net
#: height the bias counts as back at its level. Chosen by judgment; not measured.
MIN_NET_HEIGHT = 0.25


@dataclass(frozen=True)
class Excursions(Away):
    """x(t) = Σ h_i for start_i ≤ t < end_i; a fit estimates `heights` and keeps the times.

    Examples
    --------
    >>> away = al.effects.Excursions(starts=(20.0, 70.0), ends=(30.0, 90.0), heights=(0.2, -0.1))
    >>> away.count, away.largest, away.numbers
    (2.0, 0.2, 6)
    >>> x = (al.AngleRandomWalk(N=0.01) + away).simulate(duration=100, rate=10, seed=1)
    >>> fit = (al.AngleRandomWalk() + away).fit(x)
    >>> low, high = fit["EXCS.largest"].interval
    >>> bool(low < 0.2 < high)
    True
    """

    starts: tuple[float, ...] | None = None
    ends: tuple[float, ...] | None = None
    heights: tuple[float, ...] | None = None

    kind = "excursions"
    short = "EXCS"
    catalog_place = 26
    title = "several excursions"
    further = "further excursions"
    single = True
    found_with = "excursion"
    unplanned = "its evidence is that of the largest excursion: plan an excursion"
    parameters = (
        Parameter("starts", "s", "start times, from the first sample", "time"),
        Parameter("ends", "s", "end times", "time"),
        Parameter("heights", 0.0, "changes of the bias", "time", low=-np.inf),
        Parameter("count", "1", "number of excursions", "derived"),
        Parameter("largest", 0.0, "height of the largest", "derived", low=-np.inf, symbol="h"),
    )
    legend = ("count", "largest")
    physics = (
        "something acts from time to time: people at the bench, a door, a machine, a heater, a supply that sags, "
        "charge that is trapped and released"
    )
    looks_like = "low-passed samples stay at another level several times; a hump at long τ"
    check_by = "compare the times with the laboratory's log and other axes; exclude the segments"
    rivals = ("burst_noise", "bias_step", "transient", "gauss_markov")

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the parameter values; InputError for lists of unequal length, or an end that is not after its start."""
        super().__post_init__()
        lists = (self.starts, self.ends, self.heights)
        if len({len(values) for values in lists if values is not None}) > 1:
            raise InputError(
                f"{self.kind}: give one start, one end and one height for each excursion"
            )
        if any(
            end <= start for start, end in zip(self.starts or (), self.ends or (), strict=False)
        ):
            raise InputError(f"{self.kind}: each excursion must end after its start")

    @property
    def singly(self) -> tuple[Excursion, ...]:
        """Tuple of each excursion as a separate `Excursion`, in the order of `starts`; empty without any."""
        lists = (self.starts or (), self.ends or (), self.heights or ())
        return tuple(Excursion(start=a, end=b, height=h) for a, b, h in zip(*lists, strict=True))

    @classmethod
    def together(cls, events: Sequence[Deterministic]) -> Self | None:
        """One effect with all excursions of `events`, in order of time; never None.

        Where excursions overlap, their heights are added, so that the new excursions do not overlap. Segments with a
        sum near 0 are left out: a long excursion and an opposite one inside it become two excursions. If no segment is
        left, the excursions are kept as they are.
        """
        alone = sorted(
            (one.values["start"], one.values["end"], one.values["height"])
            for event in events
            for one in event.singly
        )
        edges = sorted({edge for start, end, _ in alone for edge in (start, end)})
        apart = []
        for first, last in pairwise(edges):
            there = [h or 0.0 for start, end, h in alone if start <= first and last <= end]
            if there and abs(sum(there)) > MIN_NET_HEIGHT * max(map(abs, there)):
                apart.append((first, last, sum(there)))
        starts, ends, heights = zip(*(apart or alone), strict=True)
        return cls(starts=starts, ends=ends, heights=heights)

    @property
    def count(self) -> float:
        """Number of excursions, as a float; 0.0 without `starts`."""
        return float(len(self.starts or ()))

    @property
    def largest(self) -> float:
        """Height of the largest excursion, with its sign, U; 0.0 without `heights`."""
        return max(self.heights or (0.0,), key=abs)

    @property
    def numbers(self) -> int:
        """Number of parameters: one height for each excursion, and one for each different time."""
        return len(self.starts or ()) + len({*(self.starts or ()), *(self.ends or ())})

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """Tuple that is equal for effects with equal regressors (a cache key): class, starts and ends."""
        return type(self), self.starts, self.ends

    def with_amplitudes(self, amplitudes: Array) -> Self:
        """A copy with `heights` set to the `amplitudes`, shape (excursions,)."""
        return self.with_values(heights=tuple(amplitudes.tolist()))

    def amplitudes(self) -> Array:
        """Array of the heights, U, shape (excursions,); empty without any."""
        return np.array(self.heights or ())

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array with one column for each excursion: 1 inside and 0 outside, shape (n, excursions)."""
        return np.column_stack([e.regressors(time, covariates) for e in self.singly])

    def signal(self, time: Array, covariates: Columns) -> Array:
        """Array of the sum of all excursions at each `time`, U, shape (n,); `time` must be sorted."""
        total = np.zeros(time.size)
        for one in self.singly:
            assert one.start is not None
            assert one.end is not None
            first, last = np.searchsorted(time, (one.start, one.end))
            total[first:last] += one.height or 0.0
        return total

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients `j` of every excursion of the first of the `points`, the second, …, at height 1."""
        alone = [one for point in points for one in point.singly]
        return Excursion.regressor_ordinates(alone, j, n, rate, start)

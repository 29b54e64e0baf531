"""Several excursions: the bias leaves its level now and then and comes back each time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.effects._base import Parameter
from allanite.effects._event import Away
from allanite.effects.excursion import Excursion

if TYPE_CHECKING:
    from allanite.effects.model import Model

#: A level within this part of the largest excursion about it is none.
BACK = 0.25


@dataclass(frozen=True)
class Excursions(Away):
    """x(t) = Σ h_i for start_i ≤ t < end_i: `heights` are fitted, times are as they were found.

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

    kind: ClassVar[str] = "excursions"
    short: ClassVar[str] = "EXCS"
    title: ClassVar[str] = "several excursions"
    further: ClassVar[str] = "further excursions"
    single: ClassVar[bool] = True
    unplanned: ClassVar[str] = "its evidence is that of its largest: plan an excursion"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("starts", "s", "when it leaves, from the first sample", "time"),
        Parameter("ends", "s", "when it is back", "time"),
        Parameter("heights", 0.0, "by how much", "time", low=-np.inf),
        Parameter("count", "1", "number of excursions", "derived"),
        Parameter("largest", 0.0, "height of the largest", "derived", low=-np.inf, symbol="h"),
    )
    legend: ClassVar[tuple[str, ...]] = ("count", "largest")
    physics: ClassVar[str] = (
        "something acts now and then: people at the bench, a door, a machine or a heater in turns, a supply that sags, "
        "charge that is trapped and freed"
    )
    looks_like: ClassVar[str] = (
        "the low-passed samples stand on another level for a while, several times; a hump at long τ"
    )
    check_by: ClassVar[str] = (
        "compare the times with the laboratory's log and with the other axes; leave the stretches out"
    )
    rivals: ClassVar[tuple[str, ...]] = ("burst_noise", "bias_step", "transient", "gauss_markov")

    __repr__ = brief

    def __post_init__(self) -> None:
        super().__post_init__()
        lists = (self.starts, self.ends, self.heights)
        if len({len(values) for values in lists if values is not None}) > 1:
            raise InputError(f"{self.kind}: give one start, one end and one height for each")
        if any(
            end <= start for start, end in zip(self.starts or (), self.ends or (), strict=False)
        ):
            raise InputError(f"{self.kind}: each must end after its start")

    @classmethod
    def candidates(
        cls, model: Model, columns: Mapping[str, NDArray[np.float64]]
    ) -> tuple[Self, ...]:
        """None by itself: they are looked for one by one."""
        return ()

    @property
    def singly(self) -> tuple[Excursion, ...]:
        """Each by itself, as `Excursion`."""
        lists = (self.starts or (), self.ends or (), self.heights or ())
        return tuple(Excursion(start=a, end=b, height=h) for a, b, h in zip(*lists, strict=True))

    @classmethod
    def together(cls, events: Sequence[Away]) -> Self | None:
        """All of them, first to last.

        What leaves for long and comes back within, for as long as it is away, is away twice: edges are paired anew.
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
            if there and abs(sum(there)) > BACK * max(map(abs, there)):
                apart.append((first, last, sum(there)))
        starts, ends, heights = zip(
            *(apart if 0 < len(apart) <= len(alone) else alone), strict=True
        )
        return cls(starts=starts, ends=ends, heights=heights)

    @property
    def count(self) -> float:
        """How many."""
        return float(len(self.starts or ()))

    @property
    def largest(self) -> float:
        """Height of the largest, of either sign."""
        return max(self.heights or (0.0,), key=abs)

    @property
    def numbers(self) -> int:
        """Two times and a height for each."""
        return 3 * len(self.starts or ())

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """Its times."""
        return type(self), self.starts, self.ends

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """The heights."""
        return self.with_values(heights=tuple(amplitudes.tolist()))

    def amplitudes(self) -> NDArray[np.float64]:
        """The heights."""
        return np.array(self.heights or ())

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """One column of 0 and 1 for each."""
        return np.column_stack([e.regressors(time, covariates) for e in self.singly])

    def signal(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Their sum, without a column for each."""
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
    ) -> NDArray[np.float64]:
        """A row for each of the first one's, then for each of the second's …"""
        alone = [one for point in points for one in point.singly]
        return Excursion.regressor_ordinates(alone, j, n, rate, start)

"""Known functions of time, and those that are lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Effect
from allanite.effects._waves import sines, sines_pointwise, waves

__all__ = ["Deterministic", "Periodic"]


@dataclass(frozen=True)
class Deterministic(Effect):
    """A known function of time or of another column, linear in its amplitudes.

    Examples
    --------
    >>> step, time = al.effects.BiasStep(time=1.0, height=0.2), np.arange(3.0)
    >>> step.signal(time, {}), step.regressors(time, {}).shape, step.sampler(3, 1.0, {})(1, 3)
    (array([0. , 0.2, 0.2]), (3, 1), array([0.2, 0.2]))
    >>> step.amplitudes(), step.with_amplitudes(np.array([0.3])).height
    (array([0.2]), 0.3)
    >>> step.amplitudes_held, al.effects.BiasStep(height=0.2, hold=("height",)).amplitudes_held
    (False, True)
    >>> al.RateRamp(R=0.1).own_allan_variance(np.array([10.0]), 1.0).round(6)
    array([0.5])
    >>> al.effects.DriftingLine(frequency=3.0, drift=0.1).seen_between(0.0, 10.0), step.seen_between(0.0, 2.0)
    ((3.0, 4.0), None)
    >>> al.RateRamp.best_spans(np.ones(3), np.ones(3), np.zeros((3, 0)), 100, 1.0)
    ()
    >>> al.effects.BiasStep.regressor_ordinates([step], np.arange(1, 3), 3, 1.0, 0.0).shape
    (1, 2)
    """

    screened: ClassVar[str] = "slow"
    family: ClassVar[str] = "drift"

    #: Whether it is looked for in the lowest ordinates alone; else `seen_between` says where.
    low: ClassVar[bool] = True
    #: True for one-off events (a step), which one half of a record cannot predict from the other.
    happens_once: ClassVar[bool] = False
    #: Whether the bias stays on another level after a one-off event.
    lasting: ClassVar[bool] = False
    #: Whether it is a form of a dependence that has a plainer one: named only where the record asks for it.
    refined: ClassVar[bool] = False

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n, k): the functions whose amplitudes are fitted, at this shape.

        `time` is in s from 0; `covariates` are the other columns by name, shape (n,) each.
        """
        raise NotImplementedError

    def seen_between(self, start: float, end: float) -> tuple[float, float] | None:
        """Lowest and highest frequency (Hz) from `start` to `end` (s), where it is not `low` and not `Periodic`."""
        return None

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """What the regressors depend on: the kind and every value that is no amplitude."""
        fitted = {p.name: p.role == "coefficient" for p in self.parameters}
        return type(self), *(v is None if fitted[name] else v for name, v in self.values.items())

    @property
    def amplitudes_held(self) -> bool:
        """Whether one of its amplitudes is held, so that none is fitted."""
        return any(p.role == "coefficient" and p.name in self.held for p in self.parameters)

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """A copy whose values have these k fitted `amplitudes`."""
        raise NotImplementedError

    def amplitudes(self) -> NDArray[np.float64]:
        """The k amplitudes of the values held now."""
        raise NotImplementedError

    def signal(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n,): what this effect adds to the samples at each `time`, U; `covariates` as of `regressors`."""
        return np.asarray(self.regressors(time, covariates) @ self.amplitudes())

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → what this effect adds to samples first … last − 1 of a record of n, U.

        `rate` is in Hz; `covariates` are the other columns by name, shape (n,) each.

        By default the whole record is computed once. Where a sample depends on its own time alone, `_pointwise`
        computes only those asked for.
        """
        whole = self.signal(np.arange(n) / rate, covariates)
        return lambda first, last: whole[first:last]

    def _pointwise(
        self, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A `sampler` whose samples depend on their own time alone."""
        return lambda first, last: self.signal(np.arange(first, last) / rate, covariates)

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> NDArray[np.float64] | None:
        """Cosine transform of the one regressor of each effect of `points` at ordinates j, shape (points, ordinates).

        By default None: there is no closed form, and the regressor is transformed. `start` is the time of the
        first of n samples at `rate` Hz, s.
        """
        return None

    @classmethod
    def best_spans(
        cls,
        residual: NDArray[np.float64],
        root: NDArray[np.float64],
        basis: NDArray[np.float64],
        n: int,
        rate: float,
    ) -> tuple[tuple[Deterministic, float], ...]:
        """Effects that begin at one time of this effect and end at another, each at its best two times, with its arc.

        By default none. Whitened ordinates are those of a series times `root`; `residual` are what
        is to be explained and the columns of `basis`, orthonormal, shape (ordinates, k), what others can explain of it, of
        ordinates 1, 2, … of n samples at `rate` Hz. The arc is the angle that the effect turns over all times.
        """
        return ()

    def own_allan_variance(self, m: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
        """Allan variance at averaging factors m of samples at `rate` Hz, U²; by default 0: it depends on the record."""
        return np.zeros(np.shape(m))


@dataclass(frozen=True)
class Periodic(Deterministic):
    """A sum of lines at multiples of one frequency.

    Each is looked for in a window about its frequency, whose value is polished against the spectrum.

    Examples
    --------
    >>> al.Sinusoid.at(7.3, (1, 2)).lines
    ((1, 0.0, 0.0), (2, 0.0, 0.0))
    """

    frequency: float | None = None

    screened: ClassVar[str] = "line"
    family: ClassVar[str] = "line"
    low: ClassVar[bool] = False

    @classmethod
    def at(cls, frequency: float, multiples: Sequence[float]) -> Self | None:
        """The effect at a line of this `frequency` (Hz) with lines at these `multiples` of it, 1 among them.

        None, for an effect that has places of its own, where it is none of its lines.
        """
        return cls(frequency=frequency)

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → samples of the lines."""
        lines = self._turning()
        return lambda first, last: sines_pointwise(lines, np.arange(first, last) / rate)

    @property
    def lines(self) -> tuple[tuple[float, float, float], ...]:
        """(multiple of the frequency, amplitude, phase) of each line: amplitude · sin(2π·multiple·f·t + phase)."""
        raise NotImplementedError

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Its frequency, twice."""
        return None if self.frequency is None else (self.frequency, self.frequency)

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """Frequency and multiples."""
        return type(self), self.frequency, *(m for m, _, _ in self.lines)

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Two columns, sin and cos, for each line."""
        f = self.frequency or 0.0
        return np.concatenate([waves(m * f, time) for m, _, _ in self.lines]).T

    def amplitudes(self) -> NDArray[np.float64]:
        """(A cos φ, A sin φ) of each line."""
        return np.array([a * w(p) for _, a, p in self.lines for w in (np.cos, np.sin)])

    def signal(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n,): A sin(2πft + φ) of each line, in half the time that its two regressors take."""
        return sines(self._turning(), time)

    def _turning(self) -> list[tuple[float, float, float]]:
        """Angular frequency (rad/s), amplitude and phase of each line."""
        turn = 2.0 * np.pi * (self.frequency or 0.0)
        return [(turn * m, amplitude, phase) for m, amplitude, phase in self.lines]

    def own_allan_variance(self, m: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
        """A² sin⁴(πfτ)/(m sin(πfτ0))² of each sampled line."""
        total = np.zeros(np.shape(m))
        for multiple, amplitude, _ in self.lines if self.frequency else ():
            f = multiple * (self.frequency or 0.0)
            gain = np.sin(np.pi * f * m / rate) ** 4 / (m * np.sin(np.pi * f / rate)) ** 2
            total += amplitude**2 * gain
        return total

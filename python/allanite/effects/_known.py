"""Base classes of known functions of time (deterministic effects) and of lines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.common.former import Former
from allanite.effects._base import Effect
from allanite.effects._declared import Array, Columns
from allanite.effects._waves import sines, sines_pointwise, waves

if TYPE_CHECKING:
    from allanite.effects._follower import LaggedColumn


@dataclass(frozen=True)
class Deterministic(Effect):
    """A known function of time or of a logged column, linear in its amplitudes.

    Examples
    --------
    >>> step, time = al.effects.BiasStep(time=1.0, height=0.2), np.arange(3.0)
    >>> step.signal(time, {}), step.regressors(time, {}).shape, step.sampler(3, 1.0, {})(1, 3)
    (array([0. , 0.2, 0.2]), (3, 1), array([0.2, 0.2]))
    >>> step.amplitudes(), step.with_amplitudes(np.array([0.3])).height
    (array([0.2]), 0.3)
    >>> step.lines, step.singly == (step,), al.effects.BiasStep.together([step]), al.effects.BiasStep.at(1.0, (1,))
    ((), True, None, None)
    >>> step.sums_of_lagged()  # not a function of a column
    ()
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

    screened = "slow"
    family = "drift"

    #: True if the function lies in the lowest ordinates; otherwise `seen_between` gives its frequencies.
    low: ClassVar[bool] = True
    #: True if the bias stays at another level after a one-time event.
    lasting: ClassVar[bool] = False
    #: True if a sample depends only on its own time; others need the whole record.
    memoryless: ClassVar[bool] = False
    #: True if a simpler form of the dependence exists; the refined form is suggested only if the record requires it.
    refined: ClassVar[bool] = False

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of the k functions whose amplitudes are fitted, at the present shape parameters, shape (n, k).

        `time` is in s from 0; `covariates` are the logged columns by name, shape (n,) each. Subclasses must define it.
        """
        raise NotImplementedError

    @property
    def lines(self) -> tuple[tuple[float, float, float], ...]:
        """Tuple of (multiple of `base_frequency`, amplitude, phase in rad) of each line; by default empty."""
        return ()

    @property
    def column_powers(self) -> tuple[int, ...]:
        """Exponents of a logged column for each amplitude, such as (1, 2); empty if the effect is no such polynomial."""
        return ()

    @property
    def column_loop(self) -> float:
        """Value while the followed column falls minus the value while it rises, long after a change; by default 0."""
        return 0.0

    @property
    def base_frequency(self) -> float | None:
        """Frequency of the first line, Hz; by default None: the effect is not `periodic`."""
        return None

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (f, f) with the frequency f of a line at the first sample, Hz; None for slow functions (`low`)."""
        f: float | None = None if self.low else getattr(self, "frequency", None)
        return None if f is None else (f, f)

    @classmethod
    def at(cls, frequency: float, multiples: Sequence[float]) -> Self | None:
        """New effect with lines at `multiples` of `frequency`, Hz; by default None: the kind is not `periodic`."""
        return None

    @property
    def singly(self) -> tuple[Deterministic, ...]:
        """Effects with one event (such as a step) each, in order of time, whose sum is this effect; by default itself."""
        return (self,)

    @classmethod
    def together(cls, events: Sequence[Deterministic]) -> Self | None:
        """One effect that combines several `events`; None if this kind can hold only one event (default)."""
        return None

    def sums_of_lagged(self) -> tuple[tuple[tuple[float, LaggedColumn], ...], ...]:
        """For each regressor, the pairs (weight, `LaggedColumn`) of its weighted sum; by default empty: no such sums."""
        return ()

    def seen_between(self, start: float, end: float) -> tuple[float, float] | None:
        """Pair (lowest, highest) frequency of the function between the times `start` and `end`, Hz.

        None (default) for functions whose power is in the lowest ordinates (`low`). None also for `Periodic` functions,
        because their frequencies are constant. Times are in s from the first sample.
        """
        return None

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """Tuple that is equal for effects with equal regressors (a cache key).

        It contains the class, all values that are not coefficients, and for each coefficient whether it is None.
        """
        fitted = {p.name: p.role == "coefficient" for p in self.parameters}
        return type(self), *(v is None if fitted[name] else v for name, v in self.values.items())

    @property
    def amplitudes_held(self) -> bool:
        """True if an amplitude of this effect is held or at its limit. A fit then keeps all amplitudes of the effect."""
        return any(p.role == "coefficient" and p.name in self.held for p in self.parameters)

    def _fitted_names(self) -> list[str]:
        """List of the names of the coefficients that a fit estimates; optional ones only if they have a value."""
        coefficients = (p for p in self.parameters if p.role == "coefficient")
        return [p.name for p in coefficients if not p.optional or getattr(self, p.name) is not None]

    def with_amplitudes(self, amplitudes: Array) -> Self:
        """Copy of the effect with the k fitted `amplitudes`, shape (k,), in the order of the columns of `regressors`.

        By default the amplitudes are the coefficient parameters that a fit determines, in declared order.
        """
        return self.with_values(
            **dict(zip(self._fitted_names(), map(float, amplitudes), strict=True))
        )

    def amplitudes(self) -> Array:
        """Array of the k amplitudes of the present values, shape (k,); 0 for None. By default the coefficients."""
        return np.array([getattr(self, name) or 0.0 for name in self._fitted_names()])

    def signal(self, time: Array, covariates: Columns) -> Array:
        """Signal that the effect adds to the samples at each `time`, U, shape (n,); `covariates`: see `regressors`."""
        return np.asarray(self.regressors(time, covariates) @ self.amplitudes())

    def sampler(self, n: int, rate: float, covariates: Columns) -> Callable[[int, int], Array]:
        """Function (first, last) that returns the signal of samples first … last − 1 of a record of n samples, U.

        `rate` is in Hz; `covariates` are the logged columns by name, shape (n,) each. Unless the effect is `memoryless`,
        the signal of the whole record is computed first.
        """
        if self.memoryless:
            return lambda first, last: self.signal(np.arange(first, last) / rate, covariates)
        whole = self.signal(np.arange(n) / rate, covariates)
        return lambda first, last: whole[first:last]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array | None:
        """Array of cosine-transform coefficients j of the regressor of each effect of `points`, shape (points, ordinates).

        By default None: this kind has no closed form, and its regressor is transformed numerically. `start` is the time of
        the first of n samples at `rate` Hz, s.
        """
        return None

    best_span = Former(
        "best_spans", lambda cls, *given, **named: next(iter(cls.best_spans(*given, **named)), None)
    )

    @classmethod
    def best_spans(
        cls, residual: Array, root: Array, basis: Array, n: int, rate: float
    ) -> tuple[tuple[Deterministic, float], ...]:
        """Tuple of (effect, angle): effects with two times, such as an excursion, at the best times; by default empty.

        Parameters
        ----------
        residual : ndarray, shape (ordinates,)
            Whitened residual ordinates 1, 2, … to be explained.
        root : ndarray, shape (ordinates,)
            Whitening factor (1 over the standard deviation) of each ordinate.
        basis : ndarray, shape (ordinates, k)
            Orthonormal basis (columns) of the whitened ordinates of other effects.
        n : int
            Number of samples.
        rate : float
            Sampling rate, Hz.

        Returns
        -------
        tuple of (Deterministic, float)
            Effect, and the angle (rad) by which the vector of its whitened ordinates turns as one edge moves over all
            times. The angle measures the number of independent trials.
        """
        return ()

    def own_allan_variance(self, m: Array, rate: float) -> Array:
        """Allan variance of the signal, U², at averaging factors m of samples at `rate` Hz; by default zeros.

        The Allan variance of a step, for example, depends on its place in the record.
        """
        return np.zeros(np.shape(m))


@dataclass(frozen=True)
class Periodic(Deterministic):
    """A sum of lines at multiples of one frequency.

    Each line is regressed in a window around its frequency; the frequency is optimized.

    Examples
    --------
    >>> al.Sinusoid.at(7.3, (1, 2)).lines
    ((1, 0.0, 0.0), (2, 0.0, 0.0))
    """

    frequency: float | None = None

    screened = "line"
    family = "line"
    low = False
    periodic = True

    @classmethod
    def at(cls, frequency: float, multiples: Sequence[float]) -> Self | None:
        """New effect with its only line at `frequency`, Hz, and without amplitude.

        `multiples` are the factors of `frequency` at which lines were found; the first is 1. Only classes with several
        lines, which override this method, use them; they return None if the multiples do not fit.
        """
        return cls(frequency=frequency)

    def sampler(self, n: int, rate: float, covariates: Columns) -> Callable[[int, int], Array]:
        """Function (first, last) that returns the sum of the lines at samples first … last − 1 of a record, U."""
        lines = self._angular_lines()
        return lambda first, last: sines_pointwise(lines, np.arange(first, last) / rate)

    @property
    def base_frequency(self) -> float | None:
        """Frequency of the first line, Hz; None without a frequency."""
        return self.frequency

    @property
    def seen_alike(self) -> tuple[Any, ...]:
        """Tuple that is equal for effects with equal regressors (a cache key): class, frequency and multiples."""
        return type(self), self.frequency, *(m for m, _, _ in self.lines)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of sine and cosine of each line in turn, shape (n, 2·lines)."""
        f = self.frequency or 0.0
        return np.concatenate([waves(m * f, time) for m, _, _ in self.lines]).T

    def amplitudes(self) -> Array:
        """Array of (A cos φ, A sin φ) of each line in turn, U, shape (2·lines,)."""
        return np.array([a * w(p) for _, a, p in self.lines for w in (np.cos, np.sin)])

    def signal(self, time: Array, covariates: Columns) -> Array:
        """Array of the sum of A sin(2πft + φ) over the lines at each `time` (s), U, shape (n,)."""
        return sines(self._angular_lines(), time)

    def _angular_lines(self) -> list[tuple[float, float, float]]:
        """List of (angular frequency in rad/s, amplitude, phase in rad) of each line."""
        turn = 2.0 * np.pi * (self.frequency or 0.0)
        return [(turn * m, amplitude, phase) for m, amplitude, phase in self.lines]

    def own_allan_variance(self, m: Array, rate: float) -> Array:
        """Allan variance Σ A² sin⁴(πfτ)/(m sin(πfτ0))² of the sampled lines, U², shape of m; 0 without a frequency."""
        total = np.zeros(np.shape(m))
        for multiple, amplitude, _ in self.lines if self.frequency else ():
            f = multiple * (self.frequency or 0.0)
            gain = np.sin(np.pi * f * m / rate) ** 4 / (m * np.sin(np.pi * f / rate)) ** 2
            total += amplitude**2 * gain
        return total

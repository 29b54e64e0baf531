"""What every physical effect says of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.errors import InputError
from allanite.common.validation import LARGEST
from allanite.effects import terms as _terms

if TYPE_CHECKING:
    from allanite.effects.model import Model
    from allanite.effects.terms import Term
    from allanite.recording import Recording

__all__ = ["Deterministic", "Effect", "Modifier", "Parameter", "Periodic", "Stochastic"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect.

    Attributes
    ----------
    name : str
        JSON name, as in constructors.
    unit : float or str
        A float p means U·s^p for samples in U; a string is the unit itself (``s``, ``Hz``, ``1``, ``rad``).
    low, high : float
        Bounds, exclusive of nothing that has a meaning.
    role : str
        ``coefficient`` (the model is linear in it or its square), ``shape`` (found by scan and polish), ``choice``
        (one of a few), ``time`` (found by the time view) or ``derived`` (reported only).
    aliases : tuple of str
        Short spellings in model strings.
    """

    name: str
    unit: float | str
    description: str
    role: str = "coefficient"
    low: float = 0.0
    high: float = np.inf
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Effect:
    """A physical effect with its values; a value that is None is to be fitted."""

    kind: ClassVar[str]
    short: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    #: What it physically is, what it looks like on the curves, how to confirm or refute it.
    physics: ClassVar[str]
    looks_like: ClassVar[str]
    check_by: ClassVar[str]
    #: Effects tried together share one correction for trials.
    family: ClassVar[str] = "spectral"
    #: Effects that a short record cannot tell from this one.
    rivals: ClassVar[tuple[str, ...]] = ()
    #: Names by kind of sensor ("acceleration", "frequency"); `title` is the gyroscope's.
    title: ClassVar[str]
    titles: ClassVar[Mapping[str, str]] = {}

    #: Names of parameters that a fit must not change.
    hold: tuple[str, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        for parameter in self.parameters:
            if parameter.role == "derived":
                continue
            value = getattr(self, parameter.name)
            if value is None or isinstance(value, str):
                continue
            if isinstance(value, tuple):
                object.__setattr__(self, parameter.name, tuple(float(v) for v in value))
                continue
            try:
                number = float(value)
            except (TypeError, ValueError, OverflowError):
                raise InputError(
                    f"{self.kind}: {parameter.name} = {value!r} is not a number"
                ) from None
            low, high = max(parameter.low, -LARGEST), min(parameter.high, LARGEST)
            if not low <= number <= high:
                raise InputError(
                    f"{self.kind}: {parameter.name} = {value!r} is out of its range {low:g} … {high:g}"
                )
            object.__setattr__(self, parameter.name, number)
        unknown = set(self.held) - {p.name for p in self.parameters}
        if unknown:
            raise InputError(f"{self.kind}: no parameter {', '.join(sorted(unknown))} to hold")

    @property
    def held(self) -> frozenset[str]:
        """Names of parameters that a fit must not change."""
        return frozenset(self.hold)

    @property
    def values(self) -> dict[str, Any]:
        """Parameter values by JSON name, derived ones included, None where not known."""
        return {p.name: getattr(self, p.name) for p in self.parameters}

    @property
    def free_shapes(self) -> tuple[str, ...]:
        """Shape parameters that a fit may move."""
        return tuple(
            p.name for p in self.parameters if p.role == "shape" and p.name not in self.held
        )

    def parameter(self, name: str) -> Parameter:
        """The declaration of a parameter."""
        return next(p for p in self.parameters if p.name == name)

    def with_values(self, **values: Any) -> Self:
        """A copy with other values."""
        return replace(self, **values)

    def name_for(self, kind: str = "") -> str:
        """Display name for a kind of sensor: an accelerometer's N is its velocity random walk."""
        return self.titles.get(kind, self.title)

    def __add__(self, other: Effect | Model) -> Model:
        from allanite.effects.model import Model

        return Model((self,)) + other

    def __str__(self) -> str:
        inside = ", ".join(
            f"{f.name}={value if isinstance(value, str) else f'{value:.6g}'}"
            f"{'!' if f.name in self.held else ''}"
            for f in fields(self)
            if f.name != "hold" and isinstance(value := getattr(self, f.name), (float, str))
        )
        return f"{self.short}({inside})" if inside else self.short

    def _model(self) -> Model:
        from allanite.effects.model import Model

        return Model((self,))

    def fit(self, recording: Recording, **options: Any) -> Any:
        """Fit this effect alone; see `Model.fit`."""
        return self._model().fit(recording, **options)

    def simulate(self, **options: Any) -> Recording:
        """Samples of this effect alone; see `Model.simulate`."""
        return self._model().simulate(**options)

    def simulate_chunks(self, **options: Any) -> Iterator[Recording]:
        """The same samples in consecutive pieces; see `Model.simulate_chunks`."""
        return self._model().simulate_chunks(**options)

    def psd(self, f: ArrayLike, rate: float | None = None) -> NDArray[np.float64]:
        """Two-sided density in U²/Hz; see `Model.psd`."""
        return self._model().psd(f, rate)

    def allan_variance(self, tau: ArrayLike, rate: float | None = None) -> NDArray[np.float64]:
        """Allan variance in U²; see `Model.allan_variance`."""
        return self._model().allan_variance(tau, rate)


@dataclass(frozen=True)
class Stochastic(Effect):
    """A stationary random process, or one with stationary increments, linear in its squared coefficient."""

    #: Name of the coefficient.
    coefficient: ClassVar[str]

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Primitive terms (see `effects.terms`) at this shape, with the coefficient equal to 1."""
        raise NotImplementedError

    def terms(self, rate: float) -> tuple[Term, ...]:
        """Primitive terms at this shape and coefficient."""
        value = getattr(self, self.coefficient)
        if value is None:
            raise InputError(
                f"{self.kind}: {self.coefficient} has no value yet: give one, or fit it"
            )
        return tuple(_terms.scaled(term, value**2) for term in self.unit_terms(rate))


@dataclass(frozen=True)
class Deterministic(Effect):
    """A known function of time or of another column, linear in its amplitudes.

    One that is not `Periodic` is slow: it is looked for in the lowest ordinates alone.
    """

    #: Whether it says nothing about another time than its own (a step): no half of a record predicts the other.
    happens_once: ClassVar[bool] = False

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n, k): the functions whose amplitudes are fitted, at this shape; `time` in s from 0."""
        raise NotImplementedError

    def with_amplitudes(self, amplitudes: NDArray[np.float64]) -> Self:
        """A copy whose values have these k fitted amplitudes."""
        raise NotImplementedError

    def amplitudes(self) -> NDArray[np.float64]:
        """The k amplitudes of the values held now."""
        raise NotImplementedError

    def signal(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n,): what this effect adds to the samples, U."""
        return np.asarray(self.regressors(time, covariates) @ self.amplitudes())

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → what this effect adds to samples first … last − 1 of a record of n, U.

        As here, the whole record is computed once; an effect that looks at one time after the other needs no more
        than the samples asked for (`_pointwise`).
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
        """Cosine transform of the one regressor of each point at ordinates j, shape (points, ordinates).

        None, as here, where it has no closed form and the regressor has to be transformed. `start` is the time of the
        first of n samples, s.
        """
        return None

    def own_allan_variance(self, m: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
        """Allan variance at averaging factors m, U²; 0, as here, where it depends on the record."""
        return np.zeros(np.shape(m))


@dataclass(frozen=True)
class Periodic(Deterministic):
    """A sum of lines at multiples of one frequency.

    Each is looked for in a window about its frequency, whose value is polished against the spectrum; what one half of a
    record says of the other is the power of the lines, never their phase.
    """

    frequency: float | None = None

    def sampler(
        self, n: int, rate: float, covariates: Mapping[str, NDArray[np.float64]]
    ) -> Callable[[int, int], NDArray[np.float64]]:
        """A function (first, last) → samples of the lines."""
        return self._pointwise(rate, covariates)

    @property
    def lines(self) -> tuple[tuple[int, float, float], ...]:
        """(multiple of the frequency, amplitude, phase) of each line: amplitude · sin(2π·multiple·f·t + phase)."""
        raise NotImplementedError

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Two columns, sin and cos, for each line."""
        angle = 2.0 * np.pi * (self.frequency or 0.0) * time
        return np.column_stack([w(m * angle) for m, _, _ in self.lines for w in (np.sin, np.cos)])

    def amplitudes(self) -> NDArray[np.float64]:
        """(A cos φ, A sin φ) of each line."""
        return np.array([a * w(p) for _, a, p in self.lines for w in (np.cos, np.sin)])

    def signal(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Shape (n,): A sin(2πft + φ) of each line, in half the time that its two regressors take."""
        angle = 2.0 * np.pi * (self.frequency or 0.0) * time
        total = np.zeros(time.size)
        for multiple, amplitude, phase in self.lines:
            total += amplitude * np.sin(multiple * angle + phase)
        return total

    def own_allan_variance(self, m: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
        """A² sin⁴(πfτ)/(m sin(πfτ0))² of each sampled line."""
        total = np.zeros(np.shape(m))
        for multiple, amplitude, _ in self.lines if self.frequency else ():
            f = multiple * (self.frequency or 0.0)
            gain = np.sin(np.pi * f * m / rate) ** 4 / (m * np.sin(np.pi * f / rate)) ** 2
            total += amplitude**2 * gain
        return total


@dataclass(frozen=True)
class Modifier(Effect):
    """Changes the white part of the model instead of adding a process."""

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Terms that stand for white noise of this variance per sample once the effect acts on it.

        `span` is the first and last time of the record in s, where that matters.
        """
        raise NotImplementedError

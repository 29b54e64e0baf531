"""Base classes of effects: declarations, values, limits, and the terms of random processes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from allanite.common.errors import InputError
from allanite.common.former import Former
from allanite.effects._declared import Array, has_several, log_grid, names_of
from allanite.effects._declared import Parameter as Parameter
from allanite.effects._declared import StraightLine as StraightLine
from allanite.effects._documented import document
from allanite.effects._limits import NO_LIMITS, Limits, limits_of
from allanite.effects._search_hooks import ProcessSearchHooks, SearchHooks

if TYPE_CHECKING:
    from allanite.effects.model import Model
    from allanite.effects.terms import Term
    from allanite.fit import Fit
    from allanite.recording import Recording
    from allanite.simulate import SimulationOptions
    from allanite.summary import Summary


class AsModel:
    """Methods that an effect, alone, has in common with a model."""

    def _model(self) -> Model:
        """`Model`: the model itself, or a model that contains only this effect. Subclasses must define it."""
        raise NotImplementedError

    def fit(self, recording: Recording | Summary, method: str = "whittle") -> Fit:
        """`Fit` of the model to a recording with one column, or to a summary.

        For the parameters see `allanite.fit_model`.
        """
        import allanite as al

        return al.fit_model(recording, self._model(), method)

    def simulate(
        self,
        *,
        duration: float | None = None,
        n: int | None = None,
        rate: float,
        seed: int = 0,
        unit: str = "1",
        covariates: Mapping[str, ArrayLike] | None = None,
        axis: int = 0,
        replicate: int = 0,
    ) -> Recording:
        """`Recording` of simulated samples of the model.

        Parameters
        ----------
        duration, n : float, int
            Duration in seconds, or number of samples; give one of them.
        rate : float
            Sampling rate, Hz.
        seed : int
            Seed from 0 to 2^64 − 1. The same seed gives identical samples for any number of threads.
        unit : str
            Unit U of the samples and of the values.
        covariates : mapping of str to array_like, shape (n,), optional
            Columns that effects follow.
        axis, replicate : int
            Numbers of independent records with the same seed.

        Returns
        -------
        Recording

        Raises
        ------
        InputError
            See `allanite.simulate.simulate`.
        """
        import allanite as al

        return al.simulate.simulate(
            self._model(),
            duration=duration,
            n=n,
            rate=rate,
            seed=seed,
            unit=unit,
            covariates=covariates,
            axis=axis,
            replicate=replicate,
        )

    def simulate_chunks(
        self, *, size: int = 2**20, **options: Unpack[SimulationOptions]
    ) -> Iterator[Recording]:
        """Iterator over the samples of `simulate`, in recordings of `size` samples; the last one may be shorter.

        The `options` are the parameters of `simulate`; `rate`, and `duration` or `n`, are required.
        """
        import allanite as al

        return al.simulate.simulate_chunks(self._model(), size=size, **options)

    def psd(self, f: ArrayLike, rate: float | None = None) -> Array:
        """Two-sided power spectral density, U²/Hz, at frequencies `f`, Hz, of samples at `rate` Hz; see `Model.psd`."""
        return self._model().psd(f, rate)

    def allan_variance(self, tau: ArrayLike, rate: float | None = None) -> Array:
        """Allan variance, U², at averaging times `tau`, s, of samples at `rate` Hz; see `Model.allan_variance`."""
        return self._model().allan_variance(tau, rate)


@dataclass(frozen=True)
class Effect(SearchHooks, AsModel):
    """A physical effect with its values; None is a value to be fitted.

    Optional declarations and methods for searches, which few effects override, are in `SearchHooks`.

    Examples
    --------
    >>> lag = al.GaussMarkov(q_c=0.01, correlation_time=30.0)
    >>> print(lag.with_values(q_c=0.02), lag.name_for("angular rate"), lag.shown())
    GM(q_c=0.02, correlation_time=30) Gauss-Markov process ('sigma', 'correlation_time')
    >>> print(al.AngleRandomWalk.text_for("looks_like"))
    a slope of −½; a flat density
    >>> print(lag.psd(1e-4, rate=10).round(2), np.sqrt(lag.allan_variance(57.0, rate=10)).round(3))
    0.09 0.024
    >>> x = lag.simulate(duration=1000, rate=10, seed=1, unit="deg/s")
    >>> [piece.n for piece in lag.simulate_chunks(duration=1000, rate=10, seed=1, size=4000)]
    [4000, 4000, 2000]
    >>> print(al.GaussMarkov().fit(x).model.name)
    GM

    Methods that a check uses, with the results of most effects:

    >>> al.AngleRandomWalk.text_for("looks_like", "acceleration")
    'a slope of −½; a flat density'
    >>> lag.parameter("q_c").unit, lag.grid("correlation_time", 10_000, 10.0).size
    (-0.5, 24)
    >>> al.effects.Disturbance.from_values(start=1.0, end=2.0).when, al.GaussMarkov.from_values(start=1.0)
    ((1.0, 2.0), None)
    >>> al.GaussMarkov.may_be(al.effects.BurstNoise), al.GaussMarkov.is_tried_in_spectrum()
    (True, True)
    >>> lag.kept("q_c"), al.GaussMarkov(q_c=0.01, hold=("q_c",)).kept("q_c")
    ('', 'held')
    >>> slow = al.GaussMarkov(limits={"correlation_time": (600, 900)})
    >>> lag.errors(10.0), *(ask("correlation_time", 10_000, 10.0) for ask in (slow.searched, slow.search_ends))
    ({}, array([600., 900.]), (300.0, 1800.0))
    """

    kind: ClassVar[str]
    short: ClassVar[str]
    #: Place in the catalog, which is the order in model strings; effects without a place come last.
    catalog_place: ClassVar[float] = math.inf
    parameters: ClassVar[tuple[Parameter, ...]]
    #: Physical cause of the effect.
    physics: ClassVar[str]
    #: Appearance of the effect in the samples, the Allan deviation and the spectrum.
    looks_like: ClassVar[str]
    #: Experiment that confirms or refutes the effect.
    check_by: ClassVar[str]
    #: Method by which a check searches the effect: a key of `SEARCH_METHODS`.
    screened: ClassVar[str] = "spectral"
    #: Name of the family; effects of a family share one correction for multiple trials.
    family: ClassVar[str] = "spectral"
    #: True if many logs show the effect; common effects are listed before rare ones.
    common: ClassVar[bool] = False
    #: True if two instances cannot be told from one.
    single: ClassVar[bool] = False
    #: Names of the parameters with the first and the last time of an effect that acts once.
    interval: ClassVar[tuple[str, ...]] = ()
    #: True for a sum of lines at multiples of one fitted frequency (`Deterministic.lines`).
    periodic: ClassVar[bool] = False
    #: True for a band whose frequency changes over time (`Stochastic.segments`).
    moving: ClassVar[bool] = False
    #: True if the noise level changes over time (`Modifier`); the spectrum then contains the mean over the record.
    changes_level: ClassVar[bool] = False
    #: True if the effect excludes samples of the record (`Modifier.missing`).
    removes: ClassVar[bool] = False
    #: True for one-time events (a step), which one half of a record cannot predict from the other.
    happens_once: ClassVar[bool] = False
    #: Kinds of effects that a short record cannot distinguish from this one (alternative explanations).
    rivals: ClassVar[tuple[str, ...]] = ()
    #: Straight line from which the coefficient is read, for the five effects of IEEE 952-1997; None for all others.
    standard: ClassVar[StraightLine | None] = None
    #: Why the detection cannot be planned from a spectrum, and what to plan instead; empty if it can be planned.
    unplanned: ClassVar[str] = ""
    #: Relation of the coefficient to the value that data sheets print; empty if they are equal.
    on_sheets: ClassVar[str] = ""
    #: Display name for gyroscopes, and for all sensors without an entry in `titles`.
    title: ClassVar[str]
    #: Display names by kind of sensor (`Fit.sensor`).
    titles: ClassVar[Mapping[str, str]] = {}
    #: `physics`, `looks_like` and `check_by` by kind of sensor, where they differ from those of all sensors.
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    #: Parameters that a legend shows, the most informative first; if empty, coefficients and shapes as declared.
    legend: ClassVar[tuple[str, ...]] = ()
    #: Parameters of the constructor with name and bounds.
    _given: ClassVar[tuple[tuple[Parameter, str, float, float], ...]] = ()

    #: Names of parameters that a fit must not change.
    hold: tuple[str, ...] = field(default=(), kw_only=True)
    #: Limits (low, high) of a fit by parameter name; None is an open end. `checked_limits` are these limits as `Limits`.
    limits: Mapping[str, tuple[float | None, float | None]] = field(default=NO_LIMITS, kw_only=True)
    #: Names of parameters that a fit found at a limit; they are held there until the next fit.
    at_limit: tuple[str, ...] = field(default=(), kw_only=True)

    def __init_subclass__(cls, **options: Any) -> None:
        """Extend the docstring of a new effect class, and store its parameters and their bounds for checks of values."""
        super().__init_subclass__(**options)
        document(cls)
        given = [p for p in getattr(cls, "parameters", ()) if p.role != "derived"]
        # Bounds of NaN mark parameters that are not single numbers.
        other = {p.name for p in given if p.unit == "text" or has_several(cls, p.name)}
        none = (math.nan, math.nan)
        cls._given = tuple((p, p.name, *(none if p.name in other else p.bounds)) for p in given)

    def __post_init__(self) -> None:
        """Check and convert parameter values, `held` and `limits`; InputError for an invalid value, name or limit."""
        for parameter, name, low, high in self._given:
            value = getattr(self, name)
            # Fast path: a fit makes thousands of copies per second with values in their range.
            if value is None or (type(value) is float and low <= value <= high):
                continue
            try:
                object.__setattr__(
                    self, name, parameter.accepted(value, has_several(type(self), name))
                )
            except InputError as error:
                raise InputError(f"{self.kind}: {error}") from None
        unknown = set(self.held) - {p.name for p in self.parameters} if self.held else None
        if unknown:
            raise InputError(
                f"{self.kind}: cannot hold {', '.join(sorted(unknown))}: no such parameter"
            )
        if self.limits is not NO_LIMITS:
            self._check_limits()

    def _check_limits(self) -> None:
        """Replace `limits` by checked `Limits`; raise InputError for invalid limits or a held value beyond its limits."""
        limits = limits_of(self.kind, self.parameters, self.limits)
        object.__setattr__(self, "limits", limits)
        for name in limits.keys() & set(self.hold):
            value = getattr(self, name)
            if value is not None and limits.clipped(name, value) != value:
                low, high = limits[name]
                raise InputError(
                    f"{self.kind}: {name} is held at {value:g}, outside its limits {low:g} … {high:g}"
                )

    @property
    def checked_limits(self) -> Limits:
        """`Limits` of a fit: (lower, upper) by parameter name, where an open end is ∓∞; empty without limits."""
        assert isinstance(self.limits, Limits)
        return self.limits

    @property
    def held(self) -> frozenset[str]:
        """Frozenset of the names of parameters that a fit must not change: held by the user, or at a limit."""
        return frozenset((*self.hold, *self.at_limit))

    def kept(self, name: str) -> str:
        """``"held"`` or ``"at its limit"``: the reason why a fit keeps the parameter `name`.

        Empty text without a reason.
        """
        return "held" if name in self.hold else "at its limit" if name in self.at_limit else ""

    @property
    def values(self) -> dict[str, Any]:
        """Dict of the parameter values by JSON name, including derived parameters; None for unknown values."""
        return {p.name: getattr(self, p.name) for p in self.parameters}

    @property
    def free_shapes(self) -> tuple[str, ...]:
        """Tuple of the names of the shape parameters that a fit may change (not held), in declared order.

        A shape parameter, such as a time constant or a frequency, changes the form of the spectrum or of the function.
        """
        return tuple(
            p.name for p in self.parameters if p.role == "shape" and p.name not in self.held
        )

    @classmethod
    def may_be(cls, other: Effect | type[Effect]) -> bool:
        """True if a short record may confuse this kind of effect with the effect or kind `other`.

        This holds if both have the same kind, or if one of them names the other in its `rivals`.
        """
        return cls.kind == other.kind or cls.kind in other.rivals or other.kind in cls.rivals

    @classmethod
    def is_tried_in_spectrum(cls) -> bool:
        """True for a random process or filter that searches fit to the mean spectrum, at each point of its grid."""
        return cls.screened == "spectral"

    @classmethod
    def parameter(cls, name: str) -> Parameter:
        """Declaration of the parameter with this JSON `name`; StopIteration if the effect has no such parameter."""
        return next(p for p in cls.parameters if p.name == name)

    @classmethod
    def shown(cls) -> tuple[str, ...]:
        """Tuple of the names of the parameters that a legend shows: `legend`, or by default all coefficients and shapes."""
        ours = (p.name for p in cls.parameters if p.role in {"coefficient", "shape"})
        return cls.legend or tuple(ours)

    @classmethod
    def from_values(cls, **values: Any) -> Self | None:
        """Effect of this kind with the `values` by JSON name.

        None if the names are not exactly all parameters of the kind, without derived parameters.
        """
        return cls(**values) if values.keys() == {p.name for p, *_ in cls._given} else None

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of ascending values of the shape parameter `name` that a fit tries for n samples at `rate` Hz.

        By default a parameter in s has values from two samples to half the record. Any other parameter is a frequency, with
        values from 4/T (T: duration of the record) to Nyquist. There are about 8 values per decade, at least 4 in all.
        """
        if self.parameter(name).unit == "s":
            return log_grid(2.0 / rate, n / rate / 2.0)
        return log_grid(4.0 / (n / rate), 0.5 * rate)

    def searched(self, name: str, n: int, rate: float) -> Array:
        """Array of values of the shape parameter `name` that a fit tries, ascending, for `n` samples at `rate` Hz.

        Without limits of the user, these are the values of `grid`. With limits, they are the grid values between the limits
        and each finite limit that is at most a factor of 2 beyond the grid (each finite limit if the grid contains 0).
        If this leaves no value, they are the grid values clipped to the limits.
        """
        grid = self.grid(name, n, rate)
        if name not in self.limits:
            return grid
        low, high = self.checked_limits[name]
        inside = grid[(grid > low) & (grid < high)]
        # The optimization extends a grid by a factor of 2 to both sides; limits inside that range are tried too.
        first, last = (0.5 * grid.min(), 2.0 * grid.max()) if grid.min() > 0.0 else (low, high)
        ends = [end for end in (low, high) if np.isfinite(end) and first <= end <= last]
        return np.unique([*ends, *inside]) if ends or inside.size else grid.clip(low, high)

    def search_ends(self, name: str, n: int, rate: float) -> tuple[float, float]:
        """Pair (lowest, highest) value of the shape parameter `name` that a fit of n samples at `rate` Hz may reach.

        They are half of the lowest and twice the highest value of `searched`. A parameter named ``frequency`` is at most
        the Nyquist frequency.
        """
        grid = self.searched(name, n, rate)
        most = 0.5 * rate if name == "frequency" else np.inf
        return float(grid.min()) / 2.0, min(2.0 * float(grid.max()), most)

    def errors(self, rate: float) -> dict[str, float]:
        """Dict of standard errors by name, for values that are not fitted to the spectrum (times, factors).

        It is empty by default. `rate` is the sampling rate, Hz.
        """
        return {}

    @property
    def numbers(self) -> int:
        """Number of parameters that the effect adds to a model: coefficients, shapes and times that have a value."""
        return sum(
            p.role in {"coefficient", "shape", "time"} and self.values[p.name] is not None
            for p in self.parameters
        )

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (low, high) in Hz of a band or a gap, with equal values for a line.

        None for other effects or without values.
        """
        return None

    @property
    def peaks(self) -> tuple[tuple[float, float], ...]:
        """Tuple of frequency ranges (low, high), Hz: the main band, then its sidebands.

        By default it contains only `occupies`, and is empty if this is None.
        """
        return () if self.occupies is None else (self.occupies,)

    @property
    def follows(self) -> str | None:
        """Name of the logged column that the effect follows: its `column`, if it has one; otherwise None."""
        return getattr(self, "column", None)

    @property
    def when(self) -> tuple[float, float] | None:
        """Pair (first, last) time of an effect that acts once, s from the first sample; None without values.

        By default these are the values of the two parameters that the class attribute `interval` names; None if it names
        none.
        """
        times = [getattr(self, name) for name in self.interval]
        return None if not times or None in times else (times[0], times[1])

    def with_values(self, **values: Any) -> Self:
        """Copy with some `values` changed, by JSON name.

        InputError for an invalid value, as in the constructor; TypeError for an unknown name.
        """
        own, made, names = vars(self), object.__new__(type(self)), names_of(type(self))
        if not values.keys() <= names:
            return replace(self, **values)
        # Faster than `dataclasses.replace`, which inspects every field.
        vars(made).update({name: own[name] for name in names} | values)
        made.__post_init__()
        return made

    def name_for(self, kind: str = "") -> str:
        """Display name for a `kind` of sensor, e.g. "velocity random walk" for N of "acceleration"; by default `title`."""
        return self.titles.get(kind, self.title)

    @classmethod
    def text_for(cls, name: str, kind: str = "") -> str:
        """Text `name` of the effect for a `kind` of sensor, such as "acceleration".

        `name` is "physics", "looks_like" or "check_by". Kinds without an entry in `texts` have the text of all sensors.
        """
        return str(cls.texts.get(kind, {}).get(name, getattr(cls, name)))

    def __add__(self, other: Effect | Model) -> Model:
        return self._model() + other

    def __str__(self) -> str:
        inside = ", ".join(
            f"{f.name}={f'{value:.6g}' if isinstance(value, float) else value or ''}"
            f"{'!' if f.name in self.hold else ''}{self.checked_limits.shown(f.name)}"
            for f in fields(self)
            if isinstance(value := getattr(self, f.name), (float, str)) or f.name in self.limits
        )
        return f"{self.short}({inside})" if inside else self.short

    def _model(self) -> Model:
        """`Model` with this effect only."""
        import allanite as al

        return al.Model((self,))


@dataclass(frozen=True)
class Stochastic(ProcessSearchHooks, Effect):
    """A random process whose spectrum is proportional to the square of one coefficient.

    The process, or its increments, are stationary.

    Examples
    --------
    >>> al.AngleRandomWalk().unit_terms(rate=10.0), len(al.AngleRandomWalk(N=0.1).terms(rate=10.0))
    ((White(variance=10.0),), 1)
    >>> al.effects.BurstNoise(amplitude=1.0, dwell_time=2.0).generator(rate=10.0) is None
    False
    """

    #: Name of the coefficient.
    coefficient: ClassVar[str]
    #: True for white noise; modifiers change its level.
    white: ClassVar[bool] = False
    #: True if the process drifts slowly; a slow function of time must explain more than this process.
    wanders: ClassVar[bool] = False
    #: Names of the shapes that place the further `peaks` and set their strength.
    companions: ClassVar[tuple[str, ...]] = ()

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple of spectral terms (`effects.terms`), whose sum is the process with coefficient 1, at `rate` (Hz).

        The shape parameters have their present values. Subclasses must define it.
        """
        raise NotImplementedError

    @property
    def squared_coefficient(self) -> float:
        """Square of the coefficient; InputError if the coefficient has no value."""
        value: float | None = getattr(self, self.coefficient)
        if value is None:
            raise InputError(
                f"{self.kind}: {self.coefficient} has no value; write {self.short}({self.coefficient}=…), or fit the"
                " model first"
            )
        return value**2

    def terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple of spectral terms (`effects.terms`), whose sum is the process with its present values, at `rate` (Hz)."""
        return tuple(term.scaled(self.squared_coefficient) for term in self.unit_terms(rate))

    stretches = Former("segments")

    @property
    def segments(self) -> tuple[Stochastic, ...]:
        """The process in each of the equal time segments of the record; empty unless the class declares `moving`."""
        return ()

    @property
    def gauss_markov(self) -> tuple[float, float] | None:
        """Pair (q_c, correlation time in s) of a first-order Gauss-Markov process; None for other processes.

        None also if a value is missing.
        """
        return None

    @property
    def middles(self) -> tuple[float, ...]:
        """Center frequency in each equal time segment of the record, Hz; empty unless the class declares `moving`."""
        return ()

    def generator(self, rate: float) -> tuple[str, list[float]] | None:
        """Pair (name, parameters) of the core's generator of non-normal samples at `rate` Hz; None: terms are simulated."""
        return None

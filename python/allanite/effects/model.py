"""Models: sums of effects, with spectrum, Allan variance, fit and simulation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.errors import InputError
from allanite.common.validation import positive_rate, require_frequencies
from allanite.effects._base import AsModel, Effect, Stochastic
from allanite.effects._declared import Array
from allanite.effects._filter import Filter
from allanite.effects._known import Deterministic
from allanite.effects._modifier import Modifier
from allanite.effects.terms import Term, White

if TYPE_CHECKING:
    from allanite.fit.several import Fits
    from allanite.recording import Recording
    from allanite.statespace import StateSpace

#: Maximum number of effects of a model that is fitted or predicted. The time of a fit grows with the square of the number.
#: For 10⁵ samples, 60 lines take 12 s of processor time, 100 take 23 s and 300 several minutes. `improve` adds at most 40.
MAX_EFFECTS = 64


@dataclass(frozen=True)
class Model(AsModel):
    """An immutable sum of effects; ``+`` adds effects.

    Attributes
    ----------
    effects : tuple of Effect
        The effects in the given order.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1) + al.RateRandomWalk(K=0.01)
    >>> print(model, model.name, len(model), model.replaced(1, K=0.02))
    N(N=0.1)+K(K=0.01) N+K 2 N(N=0.1)+K(K=0.02)
    >>> print(model.allan_variance(1.0, rate=10).round(6), model.psd(1.0, rate=10).round(6))
    0.010034 0.010003
    >>> recording = model.simulate(duration=1000, rate=10, seed=1, unit="deg/s")
    >>> [piece.n for piece in model.simulate_chunks(duration=1000, rate=10, seed=1, size=4000)]
    [4000, 4000, 2000]
    >>> model.fit(recording)["N"].unit, model.state_space(10.0).states
    ('deg/s·s^½', 1)
    >>> list(model.fit_columns(recording))
    ['x']
    >>> len(model.terms(10.0)), len(model.unit_terms(model.effects[0], 10.0)), model.missing(3, 10.0)
    (2, 1, None)
    >>> twice = al.parse_model("N(N=1)+LEVEL(start=0,end=30,factor=3)")
    >>> print(twice.mean_level((0.0, 80.0)), twice.steady((0.0, 80.0)))
    2.0 N(N=2)
    >>> model.limited("a fit") is model
    True
    >>> model.save("model.json")
    >>> al.parse_model("model.json") == model
    True
    """

    effects: tuple[Effect, ...]

    def __post_init__(self) -> None:
        """Raise InputError if an effect that may occur only once (`single`) occurs twice."""
        seen: set[str] = set()
        for effect in self.effects:
            if effect.single and effect.kind in seen:
                raise InputError(f"the model has {effect.kind} twice; remove one")
            seen.add(effect.kind)

    def limited(self, use: str) -> Model:
        """Model itself, after a check that it has at most 64 effects; `use` names the purpose in the message.

        Raises
        ------
        InputError
            More than 64 effects.
        """
        if len(self.effects) > MAX_EFFECTS:
            raise InputError(
                f"the model has {len(self.effects)} effects, but {use} takes at most {MAX_EFFECTS}; remove effects"
                " that are not needed"
            )
        return self

    def __add__(self, other: Effect | Model) -> Model:
        more = other.effects if isinstance(other, Model) else (other,)
        return Model(self.effects + more)

    def __iter__(self) -> Iterator[Effect]:
        return iter(self.effects)

    def __len__(self) -> int:
        return len(self.effects)

    def __str__(self) -> str:
        return "+".join(str(effect) for effect in self.effects)

    def replaced(self, place: int, **values: Any) -> Model:
        """Copy in which the effect at index `place` has other `values` by JSON name, as by `Effect.with_values`.

        ``hold``, ``limits`` and ``at_limit`` can be changed, too.
        """
        effects = list(self.effects)
        effects[place] = effects[place].with_values(**values)
        return Model(tuple(effects))

    @property
    def name(self) -> str:
        """Short names of the effects joined by ``+``, such as ``N+B+K``."""
        return "+".join(effect.short for effect in self.effects)

    @property
    def labels(self) -> list[str]:
        """List of the short name of each effect, numbered from the second of a kind on: ``N``, ``SIN``, ``SIN2``."""
        seen: dict[str, int] = {}
        out = []
        for effect in self.effects:
            number = seen[effect.short] = seen.get(effect.short, 0) + 1
            out.append(effect.short if number == 1 else f"{effect.short}{number}")
        return out

    @cached_property
    def stochastic(self) -> tuple[Stochastic, ...]:
        """Tuple of the random processes of the sum, in order."""
        return tuple(e for e in self.effects if isinstance(e, Stochastic))

    @cached_property
    def deterministic(self) -> tuple[Deterministic, ...]:
        """Tuple of the known functions of the sum, in order."""
        return tuple(e for e in self.effects if isinstance(e, Deterministic))

    @cached_property
    def modifiers(self) -> tuple[Modifier, ...]:
        """Tuple of the modifiers of the sum (level changes, filters, excluded samples), in order."""
        return tuple(e for e in self.effects if isinstance(e, Modifier))

    @cached_property
    def filters(self) -> tuple[Filter, ...]:
        """Tuple of the filters that act on all random processes, in order."""
        return tuple(f for e in self.modifiers if isinstance(f := e.whole, Filter))

    def missing(self, n: int, rate: float) -> NDArray[np.bool_] | None:
        """Boolean mask of n samples at `rate` Hz: True for samples that effects exclude.

        None if no effect excludes samples.
        """
        masks = [e.missing(n, rate) for e in self.modifiers if e.removes]
        return np.logical_or.reduce(masks) if masks else None

    @cached_property
    def white(self) -> Stochastic | None:
        """White-noise process of the model; None if the model has none."""
        return next((e for e in self.stochastic if e.white), None)

    @property
    def levels(self) -> tuple[Modifier, ...]:
        """Tuple of the effects that change the level of the white noise over time at all frequencies, not in one band."""
        return tuple(e for e in self.modifiers if e.changes_level and e.band is None)

    def mean_level(self, span: tuple[float, float]) -> float:
        """RMS level of the white noise over a record, relative to its coefficient; `span` is first and last time, s.

        It is 1 without level changes.
        """
        power = 1.0
        for level in self.levels:
            power *= sum(t.variance for t in level.modify(1.0, 1.0, span) if isinstance(t, White))
        return float(np.sqrt(power))

    def steady(self, span: tuple[float, float]) -> Model:
        """Copy without level changes of the white noise, whose coefficient is multiplied by their rms over a record.

        `span` is the first and last time of the record, s.
        """
        levels = self.levels
        out: list[Effect] = []
        for effect in self.effects:
            if levels and isinstance(effect, Stochastic) and effect is self.white:
                size = getattr(effect, effect.coefficient) * self.mean_level(span)
                out.append(effect.with_values(**{effect.coefficient: size}))
            elif not any(effect is level for level in levels):
                out.append(effect)
        return Model(tuple(out))

    def unit_terms(
        self, effect: Stochastic, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Tuple of the spectral terms of one effect at coefficient 1 and `rate` Hz, after the model's modifiers.

        Level changes and low-passes of white noise act on white noise only, and before the filters of all processes.
        `span` is the first and last time of the record, s.
        """
        out = effect.unit_terms(rate)
        if effect.white:
            # Level changes first: a level scales the input and the output of a bandwidth equally.
            for modifier in sorted(self.modifiers, key=lambda m: not m.changes_level):
                if modifier.whole is not None:
                    continue
                colored = [term for term in out if not isinstance(term, White)]
                white = [term.variance for term in out if isinstance(term, White)]
                out = (*colored, *(t for v in white for t in modifier.modify(v, rate, span)))
        # Filters of the whole signal act after modifiers of the white noise.
        for filtering in self.filters:
            out = filtering.passed(out, rate)
        return out

    def terms(self, rate: float, span: tuple[float, float] | None = None) -> tuple[Term, ...]:
        """Tuple of the spectral terms of all random processes at the present values, per sample at `rate` Hz.

        `span` is the first and last time of the record, s. InputError if a coefficient has no value.
        """
        return tuple(
            term.scaled(effect.squared_coefficient)
            for effect in self.stochastic
            for term in self.unit_terms(effect, rate, span)
        )

    def psd(self, f: ArrayLike, rate: float | None = None) -> Array:
        """Array of the two-sided power spectral density of the stochastic effects.

        Parameters
        ----------
        f : array_like
            Frequencies in Hz, within (0, rate/2].
        rate : float, optional
            Sampling rate of the discrete process, Hz. Without it the rate is so high that the density is that of the
            continuous process. Quantization and bandwidths of white noise need a rate.

        Returns
        -------
        ndarray
            Density, U²/Hz, shape of `f`; the level of white noise is N² (`docs/methods.md`).
        """
        frequency = np.atleast_1d(require_frequencies(f, "f", "Hz"))
        fs = self._rate(rate, 1.0 / (2e3 * frequency.max(initial=1e-30)))
        w = 2.0 * np.pi * frequency / fs
        total = np.zeros_like(w)
        for term in self.terms(fs):
            total += term.spectrum(w)
        return (total / fs).reshape(np.shape(f))

    def allan_variance(self, tau: ArrayLike, rate: float | None = None) -> Array:
        """Array of the expected overlapping Allan variance of the model for samples at `rate`.

        Parameters
        ----------
        tau : array_like
            Averaging times, s, rounded to multiples of 1/rate.
        rate : float, optional
            Sampling rate, Hz; without it 1000 samples per smallest τ (the continuous limit).

        Returns
        -------
        ndarray
            Variance, U², shape of `tau`. Ramps and lines add their variance. Other known functions of time add nothing,
            because their variance depends on the record.
        """
        times = np.atleast_1d(require_frequencies(tau, "tau", "s"))
        fs = self._rate(rate, times.min(initial=np.inf) / 1e3)
        m = np.maximum(np.round(times * fs), 1.0)
        total = np.zeros_like(m)
        for term in self.terms(fs):
            total += term.allan_variance(m)
        for effect in self.deterministic:
            total += effect.own_allan_variance(m, fs)
        return total.reshape(np.shape(tau))

    @staticmethod
    def _rate(rate: float | None, smallest: float) -> float:
        """Checked sampling rate, Hz; without `rate`, the inverse of the sampling interval `smallest` (s), or 1 Hz.

        It is 1 Hz if `smallest` is not a positive finite number. Raises `InputError` for a `rate` that is not positive.
        """
        if rate is None:
            return 1.0 / smallest if np.isfinite(smallest) and smallest > 0 else 1.0
        return positive_rate(rate)

    def _model(self) -> Model:
        """`Model` itself."""
        return self

    def fit_columns(self, recording: Recording, method: str = "whittle") -> Fits:
        """`Fits` (a mapping from column to `Fit`) of the model to every column; for `method` see `allanite.fit_model`."""
        import allanite as al

        return al.fit_columns(recording, self, method)

    def state_space(
        self, rate: float, *, states: int | None = None, duration: float | None = None
    ) -> StateSpace:
        """State-space form (F, Q, H, R, P0) of the random processes.

        Parameters
        ----------
        rate : float
            Sampling rate, Hz.
        states : int, optional
            Maximum number of states; `StateSpace.cost` gives the loss by the reduction.
        duration : float, optional
            Duration for which the slowest noise must be accurate, s; by default a million samples.
        """
        import allanite as al

        return al.statespace.state_space(self, rate, states=states, duration=duration)

    def save(self, path: str | Path) -> None:
        """Write the model to `path` as JSON (schema ``allanite/model/1``)."""
        from allanite.effects.files import save_model

        save_model(self, path)

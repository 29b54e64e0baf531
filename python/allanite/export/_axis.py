"""What a target needs of a model: its curves in SI, its standard coefficients, and their upper limits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import ACCELERATION, ANGULAR_RATE, coefficient_unit, parse_unit
from allanite.common.validation import positive, positive_rate
from allanite.effects._base import Stochastic
from allanite.effects._modifier import Modifier
from allanite.effects.files import model_from_dict
from allanite.effects.model import Model
from allanite.export._text import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from allanite.effects import Effect, Parameter

__all__ = ["Axis", "axes_of", "rate_of", "sized", "split", "warning_of"]

SI = {ANGULAR_RATE: "rad/s", ACCELERATION: "m/s^2", "fractional frequency": "1"}
#: τ of use and rate where nothing says them: s, Hz.
UNTIL, RATE = 1000.0, 100.0
#: Horizon of a filter where none is given: seconds without aiding that its numbers have to be right for.
HORIZON = 100.0
#: Length of the stretches among which the loudest is looked for, s, as a filter averages over its first seconds; and how
#: many of them at most.
LEVEL_STRETCH, MOST_STRETCHES = 10.0, 1000
#: Expected square of a coefficient that was not detected, over the square of its 95 % upper limit: the square of a
#: deviation at its lower bound has a half-normal distribution, of mean 0.798 σ and 95 % point 1.960 σ.
EXPECTED_SQUARE = 0.798 / 1.960


@dataclass(frozen=True, slots=True)
class Axis:
    """One fitted axis.

    Attributes
    ----------
    name : str
        Column of the recording, or the source; a harmless line of text, as `source`.
    kind : str
        Kind of sensor: ``"angular rate"``, ``"acceleration"``, …
    unit : str
        SI unit of the samples.
    rate : float or None
        Sampling rate of the recording, Hz.
    until : float
        Longest τ of use, s: a tenth of the recording.
    coefficients : mapping of str to Estimate
        Q, N, B, K, R as far as the model has them, in SI units (densities two-sided).
    model, limits : Model
        The model, the same with every random coefficient at its upper limit; values in `scale` SI units.
    corners : tuple of tuple of Model
        For each random process of `limits` alone, its forms at the ends of the intervals of its shapes and of the filters'.
    span : (float, float)
        First and last time of the recording, s, over which a noise level that changes is averaged.
    scale : float
        SI units in a unit of the samples.
    source : str
        Where the numbers came from.
    document : mapping
        The effects as they were read.
    expected : Model
        The model with every coefficient that was not detected at the root of its expected square.
    horizon : float
        Longest time without aiding, and longest τ, at which the numbers of a file have to be right, s.
    as_fitted : bool
        Whether a file has the coefficients as they were fitted, which leaves out every other effect.
    warning : str
        Why the numbers are not to be trusted: the fit was not adequate. Empty where nothing speaks against them.
    assumptions : tuple of str
        What was assumed where the numbers came from no log: a data sheet, another tool's file.
    notes : tuple of str
        What else is said of the numbers: the parts of a working state, a factor of the user.
    inflate : float
        Factor of the user on all deviations, which `scale` and `coefficients` have in them.
    turn_on : mapping or None
        Bias at switch-on over several logs, as of `allanite.axes.turn_on.TurnOn.to_dict`.
    """

    name: str
    kind: str
    unit: str
    rate: float | None
    until: float
    coefficients: Mapping[str, Estimate]
    model: Model
    limits: Model
    corners: tuple[tuple[Model, ...], ...]
    span: tuple[float, float]
    scale: float
    source: str
    document: Mapping[str, Any]
    expected: Model
    horizon: float = HORIZON
    as_fitted: bool = False
    warning: str = ""
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    inflate: float = 1.0
    turn_on: Mapping[str, Any] | None = None

    @property
    def sampling(self) -> float:
        """Rate of the curves, Hz."""
        return self.rate or RATE

    @property
    def taus(self) -> NDArray[np.float64]:
        """Averaging times up to the horizon, eight a decade, s."""
        low, high = 1.0 / self.sampling, max(self.horizon, 10.0 / self.sampling)
        m = np.geomspace(1.0, high / low, int(8 * np.log10(high / low)) + 2)
        return np.unique(np.round(m)) / self.sampling

    def steady(self, *, upper: bool = False) -> Model:
        """The model with the mean level of its white noise, or its `limits` with the largest level."""
        return _loudest(self.limits, self.span) if upper else self.model.steady(self.span)

    @property
    def loudest(self) -> tuple[float, float] | None:
        """Begin and end in s of the stretch where the white noise is loudest; None where its level does not change."""
        return _loudest_span(self.limits, self.span) if self.limits.levels else None

    @property
    def expected_steady(self) -> Model:
        """The `expected` model with the mean level of its white noise."""
        return self.expected.steady(self.span)

    @property
    def has_noise(self) -> bool:
        """Whether any random process is, or may be within its interval, more than nothing."""
        return any(getattr(e, e.coefficient) > 0.0 for e in self.limits.stochastic)

    @property
    def broad(self) -> Model:
        """What is no line, no ramp and no narrow band: what a bias may stand for; all noise where that is nothing."""
        whole = self.expected_steady
        wide = [e for e in whole.stochastic if e.occupies is None]
        return Model((*(wide or whole.stochastic), *whole.modifiers))

    @property
    def slow(self) -> Model:
        """What is no line, band or ramp and averages out no faster than white noise: no bias stands for quantization."""
        broad = self.broad
        kept = [e for e in broad.stochastic if e.occupies is None and not self._averages_out(e)]
        return Model((*kept, *broad.modifiers)) if kept else Model(())

    def _averages_out(self, effect: Effect) -> bool:
        """Whether τσ²(τ), which is constant of white noise, falls at every τ of use."""
        tau = self.taus
        level = tau * effect.allan_variance(tau, self.sampling)
        return bool((np.diff(level) <= 1e-6 * level[0]).all() and level[-1] < 0.99 * level[0])

    def allan(self, taus: NDArray[np.float64], *, upper: bool = False) -> NDArray[np.float64]:
        """Allan variance in SI, of the model or, at each τ, the largest within its intervals."""
        rate, whole = self.sampling, self.steady()
        if not upper:
            return self.scale**2 * whole.allan_variance(taus, rate)
        known = Model(self.limits.deterministic).allan_variance(taus, rate)
        return self.scale**2 * self._largest(lambda m: m.allan_variance(taus, rate), known)

    def psd(self, f: NDArray[np.float64], *, upper: bool = False) -> NDArray[np.float64]:
        """Two-sided density in SI, of the model or, at each frequency, the largest within its intervals."""
        rate = self.sampling
        if not upper:
            return self.scale**2 * self.steady().psd(f, rate)
        return self.scale**2 * self._largest(lambda m: m.psd(f, rate), np.zeros(f.shape))

    def _largest(
        self, curve: Callable[[Model], NDArray[np.float64]], total: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        for forms in self.corners:
            total = total + np.maximum.reduce([curve(_loudest(form, self.span)) for form in forms])
        return total


def _loudest_span(model: Model, span: tuple[float, float]) -> tuple[float, float]:
    """The stretch of a record in which the mean level of the white noise is largest."""
    count = int(np.clip((span[1] - span[0]) / LEVEL_STRETCH, 1, MOST_STRETCHES))
    edges = np.linspace(*span, count + 1)
    stretches = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    return max(stretches, key=model.mean_level)


def _loudest(model: Model, span: tuple[float, float]) -> Model:
    return model.steady(_loudest_span(model, span) if model.levels else span)


def axes_of(
    documents: Iterable[dict[str, Any]], unit: str | None = None, source: str = "model"
) -> list[Axis]:
    """Axes of model documents.

    Parameters
    ----------
    documents : iterable of dict
        ``allanite/fit/1`` and its relatives, or ``allanite/model/1``.
    unit : str, optional
        Unit of the samples, for models that came without a recording.
    source : str
        Name of the file, for messages.

    Raises
    ------
    InputError
        No effects, no unit, or a coefficient without a value.
    """
    return [_axis(document, unit, source) for document in documents]


def _axis(document: dict[str, Any], unit: str | None, source: str) -> Axis:
    recording = document.get("recording") or {}
    own = recording.get("unit") or unit
    document = {**document, **(document.get("working") or {})}
    effects = document.get("effects")
    if not effects:
        raise InputError(f"{source}: the document holds no effects")
    if own is None:
        raise InputError(
            f"{source}: the model has no unit",
            missing="unit",
            remedy=": say with {unit} what its samples are in",
        )
    parsed = parse_unit(own)
    model = model_from_dict({**document, "schema": "allanite/model/1"}, source)
    coefficients: dict[str, Estimate] = {}
    limits, forms, expected = [], [], []
    for effect, entry in zip(model.effects, effects, strict=True):
        given = entry.get("parameters", {})
        for parameter in effect.parameters:
            if (
                parameter.role == "coefficient"
                and not parameter.optional
                and (given.get(parameter.name, {}).get("value") is None)
            ):
                raise InputError(f"{source}: {effect.kind} has no value: fit it first")
        if effect.standard is not None:
            one = effect.parameter(effect.standard.name)
            coefficients[one.name] = _estimate(given[one.name], one, parsed.name, SI[parsed.kind])
        likely, effect = _sizes(effect, entry)
        expected.append(likely)
        limits.append(effect)
        forms.append(_ends(effect, given))
    duration = recording.get("duration_s")
    until = UNTIL if not duration else 0.1 * float(duration)
    return Axis(
        plain(recording.get("column") or source),
        parsed.kind,
        SI[parsed.kind],
        recording.get("rate_hz"),
        until,
        coefficients,
        model,
        Model(tuple(limits)),
        _corners(forms),
        (0.0, float(duration or 10.0 * UNTIL)),
        parsed.scale,
        plain(recording.get("path") or source),
        {"effects": effects, "samples": document.get("samples") or {}},
        Model(tuple(expected)),
        min(HORIZON, until),
        warning=warning_of(document),
        assumptions=tuple(plain(line) for line in document.get("assumptions", ())),
        notes=tuple(plain(line) for line in document.get("notes", ())),
        turn_on=document.get("turn_on"),
    )


def _sizes(effect: Effect, entry: Mapping[str, Any]) -> tuple[Effect, Effect]:
    """The effect with its expected size, and with its upper limit; as it is where it has no interval."""
    if not isinstance(effect, Stochastic):
        return effect, effect
    given = (entry.get("parameters") or {}).get(effect.coefficient) or {}
    end = (given.get("interval") or [None, None])[1]
    if end is None:
        return effect, effect
    name = effect.coefficient
    # Another model that explains the log as well may have more of it.
    over = (entry.get("over_rivals") or {}).get(name) or [None, None]
    upper = effect.with_values(**{name: max(float(end), float(over[1] or 0.0))})
    if given.get("detected") is not False:
        return effect, upper
    return effect.with_values(**{name: float(np.sqrt(EXPECTED_SQUARE)) * float(end)}), upper


def sized(document: Mapping[str, Any], model: Model, *, overbound: bool) -> Model:
    """A model with every effect at its expected size, or at its upper limit.

    Parameters
    ----------
    document : mapping
        Of a fit, with intervals; without them the model stays as it is.
    model : Model
        That of the document.
    overbound : bool
        Whether upper limits count.
    """
    entries = document.get("effects") or [{}] * len(model)
    pairs = [_sizes(e, entry) for e, entry in zip(model.effects, entries, strict=True)]
    return Model(tuple(upper if overbound else likely for likely, upper in pairs))


def _ends(effect: Effect, given: Mapping[str, Any]) -> list[Effect]:
    """The effect at both ends of the interval of each of its shapes, beside what was fitted."""
    found = [effect]
    for name in effect.free_shapes:
        interval = (given.get(name) or {}).get("interval") or [None, None]
        ends = [float(end) for end in interval if end is not None]
        found += [one.with_values(**{name: end}) for one in found for end in ends]
    return found


def _corners(forms: Sequence[list[Effect]]) -> tuple[tuple[Model, ...], ...]:
    """For each random process its forms, behind each form of what acts on it."""
    acting = [own for own in forms if isinstance(own[0], Modifier)]
    behind = list(product(*acting))
    return tuple(
        tuple(Model((form, *after)) for form in own for after in behind)
        for own in forms
        if isinstance(own[0], Stochastic)
    )


def warning_of(document: Mapping[str, Any]) -> str:
    """What speaks against a fit, where its document says so; ASCII, as not every reader of a comment takes more."""
    if document.get("adequate") is not False:
        return ""
    audit = (document.get("recording") or {}).get("audit") or ()
    if any(f.get("kind") == "quantisation" and f.get("severity") == "warning" for f in audit):
        return "the samples rarely change code or flip between two, which deforms the coefficients"
    worst = (document.get("error") or {}).get("adev_worst") or {}
    factor, tau = worst.get("factor"), worst.get("tau_s")
    if not factor or tau is None:
        return "the fit is not adequate"
    apart = max(float(factor), 1.0 / float(factor))
    return (
        f"the fit is not adequate: the model is off the measured Allan deviation by a factor of {apart:.3g}"
        f" at {float(tau):.3g} s"
    )


def _estimate(given: Mapping[str, Any], one: Parameter, own: str, target: str) -> Estimate:
    name, power = one.name, one.unit
    assert not isinstance(power, str)
    bounds = given.get("interval")
    interval = (
        None
        if bounds is None or None in bounds
        else (float(bounds[0] or 0.0), float(bounds[1] or 0.0))
    )
    unit = given.get("unit") or coefficient_unit(own, power)
    return Estimate(
        given["value"], given.get("std_error"), interval, unit, given.get("detected", True), name
    ).to(coefficient_unit(target, power))


def _times(value: Estimate, factor: float) -> Estimate:
    return Estimate(
        factor * value,
        None if value.std_error is None else factor * value.std_error,
        None
        if value.interval is None
        else (factor * value.interval[0], factor * value.interval[1]),
        value.unit,
        value.detected,
        value.name,
    )


def split(axes: Iterable[Axis]) -> tuple[list[Axis], list[Axis]]:
    """Gyroscope and accelerometer axes; anything else has no place in an inertial format."""
    axes = list(axes)
    for axis in axes:
        if axis.kind not in (ANGULAR_RATE, ACCELERATION):
            raise InputError(
                f"{axis.name} is a {axis.kind}: this format holds gyroscopes and accelerometers"
            )
    return (
        [axis for axis in axes if axis.kind == ANGULAR_RATE],
        [axis for axis in axes if axis.kind == ACCELERATION],
    )


def rate_of(axes: Iterable[Axis], rate: float | None, target: str) -> float:
    """Return the sampling rate for a target whose numbers hold for one rate."""
    rates = {axis.rate for axis in axes if axis.rate is not None} if rate is None else {rate}
    if len(rates) != 1:
        found = ", ".join(f"{r:g}" for r in sorted(rates)) or "none"
        raise InputError(
            f"{target} holds for one sampling rate, found {found}",
            missing="rate",
            remedy=": give {rate}",
        )
    return positive_rate(rates.pop())


def used(
    axis: Axis,
    rate: float | None,
    horizon: float | None,
    *,
    whole_record: bool = False,
    as_fitted: bool = False,
    inflate: float = 1.0,
) -> Axis:
    """The axis at another rate, up to another horizon, with a factor on all deviations.

    Parameters
    ----------
    axis : Axis
    rate : float, optional
        Samples a second, Hz; else the recording's.
    horizon : float, optional
        Longest time without aiding, s; else 100 s or a tenth of the recording, whichever is shorter.
    whole_record : bool
        Whether the horizon, where none is given, is a tenth of the recording.
    as_fitted, inflate : bool, float
        See `Axis`.
    """
    positive(inflate, "inflate", "", "give a factor, such as 5")
    if horizon is not None and not 0.0 < horizon < np.inf:
        raise InputError(f"horizon = {horizon:g} s: give a positive number of seconds")
    found = axis.until if whole_record else axis.horizon
    return replace(
        axis,
        rate=axis.rate if rate is None else positive_rate(rate),
        horizon=found if horizon is None else horizon,
        as_fitted=as_fitted,
        inflate=inflate,
        scale=axis.scale * inflate,
        coefficients={n: _times(value, inflate) for n, value in axis.coefficients.items()},
        notes=(
            *axis.notes,
            *([f"all deviations x{inflate:g}: the user's choice"] if inflate != 1.0 else []),
        ),
    )

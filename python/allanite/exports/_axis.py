"""Axes for export: the model of each axis in SI units, its coefficients, its curves and their upper limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.documents import invalid_as_input_error
from allanite.common.errors import InputError
from allanite.common.parameters import Estimate, scaled_estimate
from allanite.common.units import ACCELERATION, ANGULAR_RATE, SI_UNITS, parse_unit
from allanite.common.validation import positive, positive_rate
from allanite.effects import Effect, Model, Modifier, Stochastic
from allanite.exports._axis_model import AxisModel, FittedEffect, axis_model_of
from allanite.sources import Source, documents_of

#: Longest τ in s and sampling rate in Hz of a model without a recording. Chosen by judgment; not measured.
UNTIL, RATE = 1000.0, 100.0
#: Default horizon of a filter: longest time without aiding, s.
HORIZON = 100.0
#: Length of the segments among which the loudest is searched, s, because a filter averages over its first seconds; and the
#: maximum number of segments.
LEVEL_SEGMENT, MAX_LEVEL_SEGMENTS = 10.0, 1000
#: Maximum number n of parameters of a process for which the ellipsoid of their errors is sampled, in 3^n - 1 directions.
MAX_JOINT_PARAMETERS = 4


@dataclass(frozen=True, slots=True)
class Axis:
    """One fitted axis.

    Attributes
    ----------
    name : str
        Name of the column, or of the source. Like `source`, one line of safe text.
    kind : str
        Kind of sensor: ``"angular rate"``, ``"acceleration"``, …
    unit : str
        SI unit of the samples.
    rate : float or None
        Sampling rate of the recording, Hz.
    until : float
        Longest τ with a reliable deviation, s: a tenth of the recording.
    coefficients : mapping of str to Estimate
        Those of Q, N, B, K, R that the model has, in SI units (densities two-sided).
    model, limits : Model
        The model, and the model with every random coefficient at its upper limit; values in units of `scale` SI units.
    corners : tuple of tuple of Model
        For each random process, a model of this process for each combination of the limits of its coefficient, its shape
        parameters and those of the filters that act on it.
    span : (float, float)
        First and last time of the recording, s. A changing noise level is averaged over this span.
    scale : float
        Size of the unit of the samples in SI units.
    source : str
        Source of the numbers: a log, a data sheet, a file.
    fitted : AxisModel
        The model with the uncertainty of its parameters, in the unit of the samples.
    expected : Model
        The model in which every coefficient that was not detected has its expected size.
    horizon : float
        Longest time without aiding, and longest τ, for which the numbers of a file must be right, s.
    as_fitted : bool
        Whether a file holds the fitted coefficients and ignores all other effects.
    warning : str
        Reason not to trust the numbers: the fit is not adequate. Empty if the fit is adequate.
    assumptions : tuple of str
        Assumptions about numbers without a log: from a data sheet or the file of another program.
    notes : tuple of str
        Further remarks on the numbers: parts of the noise with motors running, a factor of the user.
    inflate : float
        Factor of the user on all deviations. `scale` and `coefficients` already include this factor.
    turn_on : mapping or None
        Bias at switch-on from several logs, as in `allanite.axes.turn_on.TurnOn.to_dict`.
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
    fitted: AxisModel
    expected: Model
    horizon: float = HORIZON
    as_fitted: bool = False
    warning: str = ""
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    inflate: float = 1.0
    turn_on: Mapping[str, Any] | None = None

    def origin(self) -> dict[str, object]:
        """Dict for JSON on the source of the numbers: `source`, `warning`, `notes`, `assumptions`.

        ``warning`` is None if there is no warning.
        """
        return {
            "source": self.source,
            "warning": self.warning or None,
            "notes": list(self.notes),
            "assumptions": list(self.assumptions),
        }

    @property
    def sampling(self) -> float:
        """Sampling rate of the curves, Hz: that of the axis, or 100 Hz if the axis has none."""
        return self.rate or RATE

    @property
    def taus(self) -> Array:
        """Averaging times in s, ascending, about eight per decade, from one sample to the horizon or to ten samples."""
        low, high = 1.0 / self.sampling, max(self.horizon, 10.0 / self.sampling)
        m = np.geomspace(1.0, high / low, int(8 * np.log10(high / low)) + 2)
        return np.unique(np.round(m)) / self.sampling

    def steady_model(self, *, upper: bool = False) -> Model:
        """`Model` of the fitted values with white noise at its mean level; `upper`: of limits, at the loudest segment."""
        return _at_loudest_level(self.limits, self.span) if upper else self.model.steady(self.span)

    @property
    def loudest_segment(self) -> tuple[float, float] | None:
        """Pair (start, end), s, of the segment of the record with the loudest white noise; None if the level is constant.

        Segments are at least 10 s long; a record below 20 s is one segment.
        """
        return _loudest_segment(self.limits, self.span) if self.limits.levels else None

    @property
    def expected_model(self) -> Model:
        """`Model` with white noise at its mean level; a coefficient that was not detected is 0.64 times its upper limit."""
        return self.expected.steady(self.span)

    @property
    def has_noise(self) -> bool:
        """True if any random process has a positive coefficient; one that was not detected has its expected size."""
        return any(getattr(e, e.coefficient) > 0.0 for e in self.expected_model.stochastic)

    @property
    def broad_model(self) -> Model:
        """`expected_model` without deterministic effects and without random processes in narrow frequency bands.

        If all processes have narrow bands, the model contains all of them. Filters and other modifiers remain.
        """
        whole = self.expected_model
        wide = [e for e in whole.stochastic if e.occupies is None]
        return Model((*(wide or whole.stochastic), *whole.modifiers))

    @property
    def slow_model(self) -> Model:
        """`Model` of white and slow noise: no narrow bands, and no noise that averages out faster than white noise.

        Modifiers remain. The model is empty if no random process remains.
        """
        broad = self.broad_model
        kept = [
            e for e in broad.stochastic if e.occupies is None and not self._is_faster_than_white(e)
        ]
        return Model((*kept, *broad.modifiers)) if kept else Model(())

    def _is_faster_than_white(self, effect: Effect) -> bool:
        """True if the Allan variance falls faster than 1/τ: τσ²(τ) never rises over `taus` and falls by over 1 %."""
        tau = self.taus
        level = tau * effect.allan_variance(tau, self.sampling)
        return bool((np.diff(level) <= 1e-6 * level[0]).all() and level[-1] < 0.99 * level[0])

    def upper_allan_variance(self, taus: Array) -> Array:
        """Largest Allan variance within the intervals of the model at `taus` (s), SI; includes known functions."""
        rate = self.sampling
        known = Model(self.limits.deterministic).allan_variance(taus, rate)
        largest = self._sum_largest_curves(lambda m: m.allan_variance(taus, rate), known)
        return self.scale**2 * largest

    def upper_psd(self, f: Array) -> Array:
        """Largest two-sided density of the model's random processes within its intervals at `f` (Hz), SI, shape of `f`."""
        rate = self.sampling
        return self.scale**2 * self._sum_largest_curves(lambda m: m.psd(f, rate), np.zeros(f.shape))

    def _sum_largest_curves(self, curve: Callable[[Model], Array], total: Array) -> Array:
        """`total` plus, for each random process, the elementwise maximum of ``curve(model)`` over `corners`."""
        for forms in self.corners:
            total = total + np.maximum.reduce(
                [curve(_at_loudest_level(form, self.span)) for form in forms]
            )
        return total


def _loudest_segment(model: Model, span: tuple[float, float]) -> tuple[float, float]:
    """Pair (start, end), s, of the segment with the largest rms level of white noise; the first of equal ones."""
    count = int(np.clip((span[1] - span[0]) / LEVEL_SEGMENT, 1, MAX_LEVEL_SEGMENTS))
    edges = np.linspace(*span, count + 1)
    segments = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    return max(segments, key=model.mean_level)


def _at_loudest_level(model: Model, span: tuple[float, float]) -> Model:
    """Copy of a model whose white noise has a constant level: that of the loudest segment in `span` (start, end in s)."""
    return model.steady(_loudest_segment(model, span) if model.levels else span)


def axes_of(
    source: Source | Axis | Sequence[Source | Axis],
    unit: str | None = None,
    name: str = "model",
    *,
    rate: float | None = None,
    record_length: float | None = None,
) -> list[Axis]:
    """List of `Axis`, one for each axis of a model, a result, a file or a model string, or of a sequence of them.

    `unit`, `rate` (Hz) and `record_length` (s) serve sources that do not state them; `name` a model without a name.
    Raises `InputError` if a model has no effects or no unit, or a coefficient has no value.
    """
    if isinstance(source, Axis):
        return [source]
    if isinstance(source, Sequence) and not isinstance(source, str):
        return [
            axis
            for one in source
            for axis in axes_of(one, unit, name, rate=rate, record_length=record_length)
        ]
    own = str(source) if isinstance(source, (str, Path)) else name
    with invalid_as_input_error(f"{own}: not a model as allanite writes it"):
        return [
            _axis_of_model(axis_model_of(d, unit, own))
            for d in documents_of(source, unit, rate, record_length)
        ]


def _axis_of_model(found: AxisModel) -> Axis:
    """`Axis` in SI units from a model with the uncertainty of its parameters."""
    parsed = parse_unit(found.unit)
    unit = SI_UNITS[parsed.kind]
    coefficients: dict[str, Estimate] = {}
    forms = []
    for one in found.effects:
        if one.effect.standard is not None:
            parameter = one.effect.parameter(one.effect.standard.name)
            fitted = one.parameter(parameter.name)
            coefficients[parameter.name] = fitted.estimate(parameter, parsed.name, unit)
        joint = _effects_on_joint_border(one, found.correlations)
        forms.append(joint or _effects_at_interval_ends(one))
    until = 0.1 * found.duration if found.duration else UNTIL
    return Axis(
        found.name,
        parsed.kind,
        unit,
        found.rate,
        until,
        coefficients,
        found.model,
        Model(tuple(one.upper for one in found.effects)),
        _models_at_corners(forms),
        (0.0, found.duration or 10.0 * UNTIL),
        parsed.scale,
        found.path,
        found,
        Model(tuple(one.expected for one in found.effects)),
        min(HORIZON, until),
        warning=found.warning,
        assumptions=found.assumptions,
        notes=found.notes,
        turn_on=found.turn_on,
    )


def _effects_at_interval_ends(fitted: FittedEffect) -> list[Effect]:
    """Copies of an effect at its upper limit: all combinations of fitted values (first) and interval ends of its shapes."""
    found = [fitted.upper]
    for name in fitted.effect.free_shapes:
        ends = [end for end in fitted.parameter(name).interval if end is not None]
        found += [one.with_values(**{name: end}) for one in found for end in ends]
    return found


def _effects_on_joint_border(
    fitted: FittedEffect, correlations: Mapping[tuple[str, str], float]
) -> list[Effect]:
    """Copies of the effect with parameters on the border of the joint 95 % region of its coefficient and shapes.

    Errors of coefficient and shape compensate, so their separate intervals would allow too much noise. The largest
    curves within the region lie above the true curve at all frequencies at once, with a probability of 95 % (linear
    approximation). Values are clipped to the range of the parameter.

    The list is empty if this region is unknown or has too many dimensions, or if an alternative model raised the upper
    limit of the coefficient above its interval.
    """
    effect, label = fitted.effect, fitted.label
    if not isinstance(effect, Stochastic) or not effect.free_shapes:
        return []
    names = (effect.coefficient, *effect.free_shapes)
    keys = [name if name == label else f"{label}.{name}" for name in names]
    unknown = any((a, b) not in correlations for a in keys for b in keys)
    if len(names) > MAX_JOINT_PARAMETERS or unknown:
        return []
    found = [fitted.parameter(name).closed_interval(effect.parameter(name)) for name in names]
    intervals = [one for one in found if one is not None]
    if len(intervals) < len(names):
        return []
    if getattr(fitted.upper, effect.coefficient) > (1.0 + 1e-9) * intervals[0][2]:
        return []
    from scipy.stats import chi2

    # Radius of the joint 95 % region over the half width of one parameter's interval.
    radius = np.sqrt(chi2.ppf(0.95, len(names)) / chi2.ppf(0.95, 1))
    values, vectors = np.linalg.eigh(np.array([[correlations[a, b] for b in keys] for a in keys]))
    root = radius * vectors * np.sqrt(np.maximum(values, 0.0))
    forms: list[Effect] = []
    for direction in _unit_directions(len(names)):
        moved = {}
        for name, shift, interval in zip(names, root @ direction, intervals, strict=True):
            declared = effect.parameter(name)
            # The half widths of a positive parameter are those of its logarithm.
            low, middle, high = np.log(interval) if declared.low >= 0.0 else interval
            place = middle + shift * (high - middle if shift > 0.0 else middle - low)
            value = float(np.exp(place) if declared.low >= 0.0 else place)
            moved[name] = min(max(value, declared.low), declared.high)
        forms.append(effect.with_values(**moved))
    return forms


def _unit_directions(size: int) -> Array:
    """Array of directions in the space of `size` parameters, one per row, shape (directions, size).

    In a plane, 16 vectors slightly longer than 1, so that the polygon through them encloses the circle. In more
    dimensions, unit vectors to the middles of all faces and edges of a cube, and to its corners.
    """
    if size == 2:
        angle = np.arange(16) * np.pi / 8
        # Between two directions a plane touches the circle this much farther out.
        return np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / 16)
    found = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=size) if any(d)])
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _models_at_corners(forms: Sequence[list[Effect]]) -> tuple[tuple[Model, ...], ...]:
    """For each random process, a tuple of `Model`: all combinations of one of its copies and one copy of every modifier.

    `forms` holds the copies of each effect of the model, such as those at the ends of their intervals.
    """
    acting = [own for own in forms if isinstance(own[0], Modifier)]
    behind = list(product(*acting))
    return tuple(
        tuple(Model((form, *after)) for form in own for after in behind)
        for own in forms
        if isinstance(own[0], Stochastic)
    )


def value_or_limit(estimate: Estimate) -> tuple[float, str]:
    """Pair (value, remark) of a coefficient; if it was not detected and has an interval, its upper limit and a remark."""
    if estimate.detected or estimate.interval is None:
        return float(estimate), ""
    return estimate.limit, "not detected, this is the 95 % upper limit"


def gyro_and_accel_axes(axes: Iterable[Axis]) -> tuple[list[Axis], list[Axis]]:
    """Tuple (list of gyroscope axes, list of accelerometer axes). Raises `InputError` for any other kind of axis."""
    axes = list(axes)
    for axis in axes:
        if axis.kind not in (ANGULAR_RATE, ACCELERATION):
            raise InputError(
                f"{axis.name} is a {axis.kind}, but this format only holds gyroscopes and accelerometers"
            )
    return (
        [axis for axis in axes if axis.kind == ANGULAR_RATE],
        [axis for axis in axes if axis.kind == ACCELERATION],
    )


def rate_of(axes: Iterable[Axis], rate: float | None, target: str) -> float:
    """Sampling rate in Hz: `rate`, or by default the one rate of all axes that have one.

    Raises `InputError` if there is no rate, if the axes have several rates, or if the rate is not positive.
    """
    rates = {axis.rate for axis in axes if axis.rate is not None} if rate is None else {rate}
    if len(rates) != 1:
        found = ", ".join(f"{r:g}" for r in sorted(rates)) or "none"
        raise InputError(
            f"the {target} file needs one sampling rate, found {found}",
            missing="rate",
            remedy=": add {rate}",
        )
    return positive_rate(rates.pop())


def axis_for_export(
    axis: Axis,
    rate: float | None,
    horizon: float | None,
    *,
    whole_record: bool = False,
    as_fitted: bool = False,
    inflate: float = 1.0,
) -> Axis:
    """Copy of an `Axis` with the sampling rate (Hz), horizon (s) and factor on deviations that apply to one export.

    The default horizon is that of the axis, or with `whole_record` a tenth of the recording. `inflate` multiplies
    coefficients, not their squares; other than 1, it adds a note. Raises `InputError` unless rate, factor and horizon
    are positive.
    """
    positive(inflate, "inflate", "", "write a positive factor, such as 5")
    if horizon is not None and not 0.0 < horizon < np.inf:
        raise InputError(f"horizon = {horizon:g} s: write a positive number of seconds")
    found = axis.until if whole_record else axis.horizon
    return replace(
        axis,
        rate=axis.rate if rate is None else positive_rate(rate),
        horizon=found if horizon is None else horizon,
        as_fitted=as_fitted,
        inflate=inflate,
        scale=axis.scale * inflate,
        coefficients={
            n: scaled_estimate(value, inflate, value.unit) for n, value in axis.coefficients.items()
        },
        notes=(
            *axis.notes,
            *([f"all deviations x{inflate:g}: the user's choice"] if inflate != 1.0 else []),
        ),
    )

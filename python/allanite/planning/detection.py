"""Detection power: what a record of given length and rate will show about an effect and the parameters of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.documents import fields_dict, jsonable
from allanite.common.errors import InputError
from allanite.common.numbers import duration_text, number
from allanite.common.printing import printed
from allanite.common.showing import text_html
from allanite.common.units import coefficient_unit, conversion
from allanite.common.validation import positive, positive_rate
from allanite.effects import (
    CATALOG,
    Deterministic,
    Effect,
    Model,
    Modifier,
    Stochastic,
    as_model,
    parse_model,
)
from allanite.effects.files import model_to_dict
from allanite.effects.sheet_units import sheet_unit
from allanite.fit.likelihood.whitened import MAX_TIME_RESOLUTION_RATIO, MIN_WHITE_SHARE
from allanite.fit.rivals.evidence import parameters_cost
from allanite.fit.rivals.score import prior
from allanite.fit.solution import Fitted, Regressed
from allanite.planning import expected as _expected
from allanite.planning.delta_logl_law import DeltaLoglLaw, family_of, needed_delta_logl
from allanite.planning.standard_errors import effect_labels, standard_errors
from allanite.suggestion.ranking import min_score

if TYPE_CHECKING:
    from allanite.common.arrays import Array
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution
    from allanite.planning.expected import Columns


@dataclass(frozen=True, slots=True, eq=False)
class Power:
    """Detection power for an effect, and standard errors of the parameters, of a planned record.

    Attributes
    ----------
    model : Model
        The true model, including the effect if one was given.
    effect : Effect or None
        The effect that `check` must find; the model fitted first lacks it.
    duration, rate : float
        Length of the record, s, and sampling rate, Hz.
    delta_log_likelihood : float or None
        Expected ΔlogL when the effect is added (mean over records). For a change of the noise level it is that of the
        search, before its times are refined.
    spread : float or None
        Standard deviation of that ΔlogL from record to record.
    needed : float or None
        Smallest ΔlogL that `check` calls significant: its p-value, corrected for all searches, is below 1 %, and the
        effect explains more than its parameters cost.
    probability : float or None
        Probability that `check` names the effect as significant.
    standard_errors : mapping of str to float
        Standard error of each parameter when the whole model is fitted, in its unit, by ``N``, ``GM.q_c``.
    unit : str or None
        Unit U of the samples for the printed table; None if the values of the model state none.

    Examples
    --------
    >>> found = al.detection_power("N(N=0.01)+K(K=1e-4)", duration=3600, rate=10)
    >>> found.value("N"), bool(found.relative("N") < 0.01), found.to_dict()["schema"]
    (0.01, True, 'allanite/power/1')
    """

    model: Model
    effect: Effect | None
    duration: float
    rate: float
    delta_log_likelihood: float | None
    spread: float | None
    needed: float | None
    probability: float | None
    standard_errors: Mapping[str, float]
    unit: str | None = None

    def value(self, name: str) -> float:
        """True value of the parameter `name`, a key of `standard_errors`.

        Raises
        ------
        InputError
            The model has no such parameter.
        """
        effect, parameter = self._effect_and_parameter(name)
        return float(effect.values[parameter])

    def _effect_and_parameter(self, name: str) -> tuple[Effect, str]:
        """Tuple (effect of the model, name of its parameter) for a key of `standard_errors`, such as ``GM.q_c``.

        Raises `InputError` for any other name.
        """
        label, _, parameter = name.partition(".")
        for found, effect in zip(effect_labels(self.model), self.model, strict=True):
            if found == label and (parameter or label) in effect.values:
                if name in self.standard_errors:
                    return effect, parameter or label
                raise InputError(
                    f"{name} has no value, for example because it was not detected; give one in the model, such as"
                    f" {effect.short}({parameter or label}=…)"
                )
        known = ", ".join(self.standard_errors)
        raise InputError(
            f"{name}: the model has no such parameter (it has: {known}); add its effect to the model"
        )

    def relative(self, name: str) -> float:
        """Standard error of the parameter `name` (``K``, ``GM.correlation_time``) divided by the magnitude of its value.

        Infinite for a value of 0.
        """
        return self.standard_errors[name] / abs(self.value(name)) if self.value(name) else np.inf

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/power/1``; infinite standard errors, absolute or relative, become None."""
        return {
            "schema": "allanite/power/1",
            "version": _kernels.version(),
            **fields_dict(self, duration="duration_s", rate="rate_hz", unit=""),
            "model": str(self.model),
            "effects": model_to_dict(self.model)["effects"],
            "effect": None if self.effect is None else self.effect.kind,
            "standard_errors": jsonable(
                {
                    name: {
                        "value": self.value(name),
                        "std_error": error,
                        "relative": self.relative(name),
                    }
                    for name, error in self.standard_errors.items()
                }
            ),
        }

    def __str__(self) -> str:
        lines = [f"{self.model.name} over {duration_text(self.duration)} at {self.rate:.6g} Hz"]
        if self.effect is not None and self.probability is not None:
            lines.append(
                f"check finds {self.effect.kind} with probability {self.probability:.3f}: ΔlogL "
                f"{self.delta_log_likelihood:.1f} ± {self.spread:.1f} expected, {self.needed:.1f} needed"
            )
        lines.append(f"{'':22} {'value':>12} {'std. error':>12}  {'relative':>9}  unit")
        for name, error in self.standard_errors.items():
            unit, factor = self._unit_and_factor(name)
            value, spread = (number(factor * v) for v in (self.value(name), error))
            share = f"{number(100.0 * self.relative(name), 2)} %"
            lines.append(f"{name:22} {value:>12} {spread:>12}  {share:>9}  {unit}".rstrip())
        if self.unit is None:
            lines.append("U is the unit of the samples, because the values of the model state none")
        return "\n".join(lines)

    def _unit_and_factor(self, name: str) -> tuple[str, float]:
        """Tuple (printed unit of a parameter, empty for no unit; factor that converts its value to this unit)."""
        effect, own = self._effect_and_parameter(name)
        parameter = effect.parameter(own)
        power = parameter.unit
        if not isinstance(power, float):
            return "" if power == "1" else power, 1.0
        if self.unit is None:
            return {1.0: "U·s", 0.5: "U/√Hz", -0.5: "U/√s", -1.0: "U/s"}.get(power, "U"), 1.0
        unit = sheet_unit(parameter, self.unit)
        return printed(unit), conversion(coefficient_unit(self.unit, power), unit)

    _repr_html_ = text_html


def detection_power(
    model: Model | Effect | str,
    effect: Effect | str | None = None,
    *,
    duration: float,
    rate: float,
    covariates: Columns | None = None,
) -> Power:
    """`Power`: detection power of `check` for an effect in a planned record, and standard errors of all parameters.

    Nothing is simulated. The model is fitted to the expected record, in which every bin has its expected power, with and
    without the effect. Twice the difference of logL is the non-centrality of the test that `check` makes.

    Parameters
    ----------
    model : Model, Effect or str
        Model without the effect, with values.
    effect : Effect or str, optional
        Effect to be found, with values.
    duration, rate : float
        Length of the record, s, and sampling rate, Hz.
    covariates : mapping of str to callable, optional
        Expected course of each column as a function of time in s, shape (n,) → (n,).

    Returns
    -------
    Power

    Raises
    ------
    InputError
        A value is missing, a column is not described, or the spectrum does not show the effect.
    TooShortError
        Fewer samples than a fit needs.

    References
    ----------
    Cowan, G., Cranmer, K., Gross, E. & Vitells, O. (2011). Asymptotic formulae for likelihood-based tests of new physics.
    Eur. Phys. J. C 71, 1554: the expected record ("Asimov data set").

    Examples
    --------
    >>> line = al.Sinusoid(frequency=7.3, amplitude=6e-3)
    >>> found = al.detection_power("N(N=0.01)", line, duration=600, rate=100)
    >>> bool(found.probability > 0.9)
    True
    """
    base = as_model(model)
    added = None if effect is None else as_effect(effect)
    rate = positive_rate(rate)
    duration = positive(duration, "duration", "s", "a positive number of seconds")
    whole = base if added is None else base + added
    _expected.require_values(whole)
    data = _expected.blank_data(round(duration * rate), rate)
    grid = _expected.coarse_data(data, covariates)
    errors = MappingProxyType(standard_errors(whole, data, grid))
    if added is None:
        return Power(whole, None, duration, rate, None, None, None, None, errors)
    found = predicted_detection(base, added, data, grid)
    return Power(
        whole,
        added,
        duration,
        rate,
        found.law.mean,
        found.law.spread,
        max(found.needed, found.paying),
        found.probability,
        errors,
    )


def as_effect(effect: Effect | str) -> Effect:
    """`Effect`: `effect` itself, or the single effect that a string describes.

    Raises `InputError` if the string has several effects, or if the effect cannot be planned from a spectrum.
    """
    if isinstance(effect, str):
        parsed = parse_model(effect)
        if len(parsed) != 1:
            raise InputError(f"{effect!r} has {len(parsed)} effects: plan for one at a time")
        effect = parsed.effects[0]
    if effect.unplanned:
        raise InputError(f"{effect.kind}: not planned from a spectrum: {effect.unplanned}")
    return effect


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Prediction of the test that `check` makes for an effect.

    `law` is the distribution of ΔlogL relative to the model without the effect. `tested` is that of the ΔlogL that the
    test uses. For a slow function of time it is relative to the best model that may have one more wandering process. For a
    change of level both are that of a search on a grid of times.
    `needed` is the smallest tested ΔlogL, nats, with a p-value below 1 %, corrected for all searches. `paying` is the
    smallest ΔlogL, nats, with which the effect explains more than its parameters cost. For a change of level, `paying`
    is −∞.
    """

    law: DeltaLoglLaw
    tested: DeltaLoglLaw
    needed: float
    paying: float

    @property
    def probability(self) -> float:
        """Probability that `check` finds the effect, 0 … 1: ΔlogL is significant and pays for the parameters.

        The two ΔlogL rise and fall together, so the smaller of the two probabilities is that of both conditions.
        """
        significant = self.tested.exceedance_probability(self.needed)
        return min(significant, self.law.exceedance_probability(max(self.paying, 0.0)))


def predicted_detection(base: Model, effect: Effect, data: Data, grid: Data) -> Detection:
    """`Detection`: predicted distribution of ΔlogL if `effect` is added to `base`, with the limits it must exceed.

    Nothing is simulated: `base` is fitted to the expected power of `base` plus `effect`. For a level change, it is fitted
    to the expected power of `base` alone.
    """
    noise = _expected.random_part(base)
    if isinstance(effect, Modifier) and effect.changes_level:
        law = tested = _level_change_law(noise, effect, data)
        null = _expected.best_fit(noise, _expected.expected_power(noise, data), data)
    else:
        signal = np.zeros(data.bins.count.size)
        true = _expected.expected_power(noise + effect, data)
        if isinstance(effect, Deterministic):
            signal = _expected.signal_power(effect, data, grid)
        measured = true + signal / data.bins.count
        null = _expected.best_fit(noise, measured, data)
        law = tested = _delta_logl_law(base, null, effect, true, data, grid)
        if isinstance(effect, Deterministic) and not effect.periodic:
            # `check` compares a slow function of time with the best random process instead.
            fits = [
                null,
                *(_expected.best_fit(m, measured, data) for m in _with_wandering_process(noise)),
            ]
            best = max(fits, key=lambda s: s.log_likelihood)
            tested = _delta_logl_law(base, best, effect, true, data, grid)
    family, families = family_of(base, effect, null, data, grid)
    paying = min_score(effect) + _expected_cost(noise, effect, null, law, data) - prior(effect)
    return Detection(law, tested, needed_delta_logl(family, families), paying)


def _expected_cost(
    noise: Model, effect: Effect, null: Solution, law: DeltaLoglLaw, data: Data
) -> float:
    """Cost of the parameters of the effect in ln evidence, nats, as `check` computes it for the expected record.

    `null` is the fit of `noise`, the random part of the model without the effect.
    """
    if isinstance(effect, Stochastic):
        whole = _expected.best_fit(
            noise + effect, _expected.expected_power(noise + effect, data), data
        )
        return parameters_cost(whole.effects[-1], whole)
    if isinstance(effect, Deterministic):
        # One amplitude, whose relative error is that of the function.
        unit, covariance = np.ones(1), np.full((1, 1), 1.0 / max(law.signal.sum(), 1e-300))
        return parameters_cost(Regressed(effect, unit, covariance, np.zeros((0, 1)), effect), null)
    return parameters_cost(Fitted(effect), null)


def _delta_logl_law(
    base: Model, null: Solution, effect: Effect, true: Array, data: Data, grid: Data
) -> DeltaLoglLaw:
    """Predicted distribution (`DeltaLoglLaw`) of ΔlogL if `effect` is added to the model `base`.

    `null` is the random part of `base`, fitted to the expected power of a record that contains the effect. `true` is the
    noise power in each bin of this record.
    """
    added = sum(
        p.role not in {"derived", "choice"} and p.unit != "text" and p.name not in effect.held
        for p in effect.parameters
    )
    free = null.columns[:, null.theta > 0.0] / null.spectrum[:, None]
    known = _expected.known_directions(base, null, data, grid)
    signal = np.zeros(null.count.size)
    if isinstance(effect, Deterministic):
        signal = _expected.whitened_signal_power(effect, known, null, data, grid)
    taken = _expected.absorbed_ordinates(known, data)
    return DeltaLoglLaw(null.count, true / null.spectrum, signal, free, added, taken)


def _with_wandering_process(noise: Model) -> list[Model]:
    """List of `Model` to be fitted: `noise` plus one slowly drifting process without values (flicker, random walk, …) each.

    Such a process can look like a slow function of time. Kinds that `noise` has already are left out.
    """
    return [
        noise + blank
        for cls in CATALOG
        if issubclass(cls, Stochastic) and cls.wanders
        for blank in cls.candidates(noise, {})
    ]


def _level_change_law(noise: Model, effect: Modifier, data: Data) -> DeltaLoglLaw:
    """Distribution of the tested ΔlogL of two white-noise levels relative to one, over bins that white noise dominates.

    The test uses only the highest octaves of these bins (`white_power`). It searches both times on a grid, so only the
    factor counts as fitted.

    Raises `InputError` if the model has no white noise.
    """
    if noise.white is None:
        raise InputError(f"{effect.kind}: the model has no white noise whose level could change")
    white = Model((noise.white,))
    part: Array = _expected.expected_power(white, data) / _expected.expected_power(noise, data)
    top, seen = data.bins.edges[1:], part > MIN_WHITE_SHARE
    # Lower octaves have too few values in time.
    seen &= top > top[seen].max(initial=0) / MAX_TIME_RESOLUTION_RATIO
    total = float(data.bins.count[seen].sum())
    share = float((data.bins.count * part)[seen].sum()) / max(total, 1.0)
    start, end = effect.when or data.span
    inside = max(0.0, min(end, data.duration) - max(start, 0.0)) / data.duration
    ratio = np.array([1.0 + share * (float(effect.mean_power(start, end)) - 1.0), 1.0])
    weight = np.array([inside, 1.0 - inside])
    return DeltaLoglLaw(total * weight, ratio / (weight @ ratio), np.zeros(2), np.zeros((2, 0)), 1)

"""Model of one axis with the uncertainty of its parameters, as a fit, a file or another source states it.

Only this module of the exports knows the keys of the JSON form of results (`allanite.sources.documents_of`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from allanite.common.documents import invalid_as_input_error
from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import coefficient_unit, parse_unit
from allanite.effects import Effect, Model, Parameter, Stochastic
from allanite.effects.files import model_from_dict
from allanite.exports._text import MAX_SENTENCE_LENGTH, plain
from allanite.recording.distorted import DISTORTIONS
from allanite.suggestion.constants import MAX_ALLAN_ERROR_SCATTERS

#: Expected square of a coefficient that was not detected, over the square of its 95 % upper limit: the square of a
#: deviation at its lower bound has a half-normal distribution, of mean 0.798 σ and 95 % point 1.960 σ.
EXPECTED_SQUARE = 0.798 / 1.960

#: Lower and upper end of a 95 % interval; None for an open end.
Interval = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class FittedParameter:
    """Value and uncertainty of one parameter of an effect; by default, nothing is known.

    `value` is a list for a parameter with several numbers, and a text for the name of a column. Only a single number
    has a 95 % `interval`, whose ends may be None. If the parameter was not `detected`, the upper end is an upper limit.
    `unit` is empty if the source does not state it.
    """

    value: float | str | list[float] | None = None
    std_error: float | None = None
    interval: Interval = (None, None)
    detected: bool = True
    unit: str = ""

    def estimate(self, parameter: Parameter, own: str, target: str) -> Estimate:
        """`Estimate` for samples in the unit `target`, where those of the source are in `own`.

        It has no interval if an end is open. Raises `InputError` if the units do not match.
        """
        power, (low, high) = parameter.unit, self.interval
        assert isinstance(self.value, float)
        assert not isinstance(power, str)
        return Estimate(
            self.value,
            self.std_error,
            None if low is None or high is None else (low, high),
            self.unit or coefficient_unit(own, power),
            self.detected,
            parameter.name,
        ).to(coefficient_unit(target, power))

    def closed_interval(self, parameter: Parameter) -> tuple[float, float, float] | None:
        """Tuple (lower end, value, upper end) of the 95 % interval, or None.

        None if the parameter is no single number or was not detected, or if its interval is open or does not contain
        the value. None also for a positive parameter whose interval reaches 0.
        """
        low, high = self.interval
        if not isinstance(self.value, float) or low is None or high is None or not self.detected:
            return None
        reaches_zero = parameter.low >= 0.0 and not low > 0.0
        return None if reaches_zero or not low <= self.value <= high else (low, self.value, high)


@dataclass(frozen=True, slots=True)
class FittedEffect:
    """One effect of a model, with its fitted values and the uncertainty of its parameters, by name.

    `over_rivals` has the ends of the intervals that also cover alternative models of the log. `rivals` are the kinds of
    the effects in these models that take the place of this effect.
    """

    effect: Effect
    label: str
    parameters: Mapping[str, FittedParameter]
    over_rivals: Mapping[str, Interval]
    rivals: tuple[str, ...]

    def parameter(self, name: str) -> FittedParameter:
        """`FittedParameter` with this name; one without value and interval if the source does not state it."""
        return self.parameters.get(name, FittedParameter())

    @property
    def hidden(self) -> bool:
        """True for a random process whose coefficient was not detected."""
        effect = self.effect
        return isinstance(effect, Stochastic) and not self.parameter(effect.coefficient).detected

    @property
    def upper(self) -> Effect:
        """The effect with the largest upper limit, if any, of its coefficient, over alternative models of the log, too."""
        end = self._upper_end
        if end is None or not isinstance(self.effect, Stochastic):
            return self.effect
        # An alternative model of the log may allow a larger coefficient.
        over = self.over_rivals.get(self.effect.coefficient, (None, None))[1]
        return self.effect.with_values(**{self.effect.coefficient: max(end, over or 0.0)})

    @property
    def expected(self) -> Effect:
        """The effect; if its coefficient was not detected, with 0.64 times the upper end of its interval."""
        end = self._upper_end
        if end is None or not self.hidden or not isinstance(self.effect, Stochastic):
            return self.effect
        return self.effect.with_values(
            **{self.effect.coefficient: float(np.sqrt(EXPECTED_SQUARE)) * end}
        )

    @property
    def _upper_end(self) -> float | None:
        """Upper end of the interval of the coefficient of a random process; None without one, and for other effects."""
        if not isinstance(self.effect, Stochastic):
            return None
        return self.parameter(self.effect.coefficient).interval[1]


@dataclass(frozen=True, slots=True)
class AxisModel:
    """Model of one axis with the uncertainty of its parameters, and what its source states about the record.

    `effects` are in the order of the model. `correlations` has each pair of parameters in both orders; empty if
    unknown. `name` and `path` of the log are one line of safe text. `rate` is in Hz, `duration` in s. `warning` is a
    reason not to trust the model, or empty. `turn_on` is `allanite.axes.turn_on.TurnOn.to_dict`. `mean` is that of the
    samples. `references` has the reference value of each logged column that the model uses. `entries` are the effects
    in the form of the source, to be written to JSON files.
    """

    model: Model
    effects: tuple[FittedEffect, ...]
    correlations: Mapping[tuple[str, str], float]
    unit: str
    name: str
    path: str
    rate: float | None
    duration: float | None
    warning: str
    assumptions: tuple[str, ...]
    notes: tuple[str, ...]
    turn_on: Mapping[str, Any] | None
    mean: float | None
    references: Mapping[str, Any]
    entries: Sequence[Mapping[str, Any]]


def axis_model_of(document: Mapping[str, Any], unit: str | None, source: str) -> AxisModel:
    """`AxisModel` from the JSON document of a fit or a model; `unit` is used if the document states none.

    A model that holds while motors run (key ``working``) replaces the fitted one. Raises `InputError` if effects, the
    unit or the value of a coefficient are missing.
    """
    recording = document.get("recording") or {}
    own = recording.get("unit") or unit
    document = {**document, **(document.get("working") or {})}
    entries = document.get("effects")
    if not entries:
        raise InputError(f"{source}: the file holds no effects, so it is not a model")
    if own is None:
        raise InputError(
            f"{source}: the model does not state the unit of its samples",
            missing="unit",
            remedy=": add {unit}",
        )
    parse_unit(own)
    model = model_from_dict({**document, "schema": "allanite/model/1"}, source)
    effects = _fitted_effects(model, entries)
    for one in effects:
        for parameter in one.effect.parameters:
            needed = parameter.role == "coefficient" and not parameter.optional
            if needed and one.parameter(parameter.name).value is None:
                raise InputError(
                    f"{source}: {one.effect.kind} has no value: fit the model first, or write the value"
                )
    duration, samples = recording.get("duration_s"), document.get("samples") or {}
    return AxisModel(
        model,
        effects,
        _correlations_of(document),
        own,
        plain(recording.get("column") or source),
        plain(recording.get("path") or source),
        recording.get("rate_hz"),
        float(duration) if duration else None,
        warning_of(document),
        _plain_sentences(document.get("assumptions", ())),
        _plain_sentences(document.get("notes", ())),
        document.get("turn_on"),
        samples.get("mean"),
        samples.get("references") or {},
        entries,
    )


def model_of_expected_size(document: Mapping[str, Any], model: Model, *, overbound: bool) -> Model:
    """Copy of a model with 0.64 times the limit of undetected coefficients; with `overbound`, with all upper limits."""
    with invalid_as_input_error("the intervals do not have the format of a fit"):
        effects = _fitted_effects(model, document.get("effects") or [{}] * len(model))
    return Model(tuple(one.upper if overbound else one.expected for one in effects))


def _fitted_effects(model: Model, entries: Sequence[Mapping[str, Any]]) -> tuple[FittedEffect, ...]:
    """Tuple with a `FittedEffect` for each effect of a model, from its entry in a document."""
    return tuple(
        FittedEffect(
            effect,
            label,
            {name: _parameter_of(given) for name, given in _items(entry, "parameters")},
            {name: _interval_of(ends) for name, ends in _items(entry, "over_rivals")},
            tuple(map(str, entry.get("rivals") or ())),
        )
        for label, effect, entry in zip(model.labels, model.effects, entries, strict=True)
    )


def _items(entry: Mapping[str, Any], key: str) -> Iterable[tuple[str, Any]]:
    """Pairs (name, value) of the mapping under a key of an entry; none if the key is missing or the value is empty."""
    return (entry.get(key) or {}).items()


def _parameter_of(given: Mapping[str, Any] | None) -> FittedParameter:
    """`FittedParameter` from its entry in a document."""
    if not given:
        return FittedParameter()
    value = given.get("value")
    if value is not None and not isinstance(value, (int, float)):
        return FittedParameter(value, unit=given.get("unit") or "")
    return FittedParameter(
        _number_or_none(value),
        _number_or_none(given.get("std_error")),
        _interval_of(given.get("interval")),
        given.get("detected") is not False,
        given.get("unit") or "",
    )


def _interval_of(ends: Sequence[Any] | None) -> Interval:
    """Pair of the ends of an interval; an end is None if it is open."""
    low, high = ends or (None, None)
    return _number_or_none(low), _number_or_none(high)


def _number_or_none(value: Any) -> float | None:
    """The value as a float; None for None."""
    return None if value is None else float(value)


def _plain_sentences(lines: Iterable[object]) -> tuple[str, ...]:
    """Tuple of the sentences as one-line texts that are safe in every file format, each cut to 1000 characters."""
    return tuple(plain(line, MAX_SENTENCE_LENGTH) for line in lines)


def _correlations_of(document: Mapping[str, Any]) -> dict[tuple[str, str], float]:
    """Correlation of the estimates of each pair of parameters, in both orders; empty without a valid matrix."""
    found = document.get("correlations")
    if not isinstance(found, dict):
        return {}
    names = found.get("names")
    try:
        matrix = np.asarray(found.get("matrix"), dtype=np.float64)
    except (TypeError, ValueError):
        return {}
    if not isinstance(names, list) or matrix.shape != (len(names), len(names)):
        return {}
    if not bool((np.abs(matrix) <= 1.0 + 1e-6).all()):
        return {}
    return {
        (str(a), str(b)): float(matrix[i, k])
        for i, a in enumerate(names)
        for k, b in enumerate(names)
    }


def warning_of(document: Mapping[str, Any]) -> str:
    """First reason not to trust the fit in a document; empty unless the document says that it is not adequate.

    The text is ASCII, because some programs refuse other characters in comments.
    """
    if document.get("adequate") is not False:
        return ""
    audit = (document.get("recording") or {}).get("audit") or ()
    if any(f.get("kind") == "quantisation" and f.get("severity") == "warning" for f in audit):
        return (
            "the samples rarely change or flip between two codes, which distorts the coefficients"
        )
    if any(f.get("kind") in DISTORTIONS for f in audit):
        return "a dead zone or dead band distorts the samples, which no noise model describes"
    error = document.get("error") or {}
    worst = error.get("adev_worst") or {}
    factor, tau = worst.get("factor"), worst.get("tau_s")
    rms, scatter = error.get("adev_rms_percent"), error.get("chance_rms_percent")
    within = bool(rms and scatter and rms <= MAX_ALLAN_ERROR_SCATTERS * scatter)
    if factor and tau is not None and not within:
        apart = max(float(factor), 1.0 / float(factor))
        return (
            f"the fit is not adequate: model and measured Allan deviation differ by a factor of {apart:.3g}"
            f" at {float(tau):.3g} s"
        )
    reduced = (document.get("misfit") or {}).get("reduced")
    percent = (document.get("discrepancy") or {}).get("percent")
    if percent:
        return f"the fit is not adequate: it needs a model discrepancy of {percent:.2g} %"
    return "the fit is not adequate" + (f": chi2/dof = {reduced:.3g}" if reduced else "")

"""Model form that the axes of a sensor share, and whether their coefficients agree."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import plain_value
from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import conversion
from allanite.effects import Effect, Model, Modifier, Stochastic
from allanite.fit import refitted
from allanite.fit.engine import solve
from allanite.fit.likelihood.discrepancy import HALF_CHI2_95
from allanite.fit.models import parameter_label
from allanite.fit.rivals.alternatives import MAX_POLISH_DELTA_LOGL
from allanite.fit.several import pooled_by_errors
from allanite.suggestion.exclusions_first import excludes_or_changes_level

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from allanite.effects import Parameter
    from allanite.fit.result import Fit
    from allanite.fit.several import Pooled

#: Axes differ in a parameter if its p-value times the number of parameters is below this level.
DIFFERENCE_LEVEL = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """Comparison of one parameter of a model form over the `columns` that detect the parameter.

    `pooled` has the common value in the unit of the first of the columns, and the p-value of equality.
    """

    pooled: Pooled
    columns: tuple[str, ...]
    parameter: Parameter

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: columns, and the entries of `Pooled.to_dict` (value, interval, p-value, …)."""
        return {**self.pooled.to_dict(), "columns": list(self.columns)}


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """Model form: random effects that every axis of a sensor detects, or cannot exclude with the values of another axis.

    `model` is the sum of their short names. `besides` has the short names of further effects of each column; lines,
    drifts and outliers always count as such. `numbers` are the parameters that two or more axes detect.
    """

    model: str
    besides: Mapping[str, tuple[str, ...]]
    numbers: tuple[Agreement, ...]

    @property
    def agree(self) -> bool:
        """True if no parameter differs significantly between the axes, at 5 % over all parameters together (Bonferroni)."""
        least = min((n.pooled.p_value for n in self.numbers), default=1.0)
        return least * len(self.numbers) >= DIFFERENCE_LEVEL

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: ``model`` (sum of short names), ``agree`` (bool), ``parameters`` (list of the compared ones)."""
        form = {"model": self.model, "agree": self.agree}
        return form | {"parameters": plain_value(self.numbers)}


def common_form(fits: Mapping[str, Fit]) -> Form | None:
    """`Form`: the effects that all axes have in common; None for fewer than two axes or without a common noise process."""
    if len(fits) < 2:
        return None
    labels = labels_of([fit.model for fit in fits.values()])
    axes = [_Axis(*one) for one in zip(fits, fits.values(), labels, strict=True)]
    every = (pair for axis in axes for pair in axis.effects.items())
    lasting = {label: effect for label, effect in every if _may_be_shared(effect)}
    kept = [label for label in lasting if _belongs_to_form(label, axes)]
    if not any(isinstance(lasting[label], Stochastic) for label in kept):
        return None
    return Form(
        Model(tuple(lasting[label] for label in kept)).name,
        {axis.column: axis.other_detected(kept) for axis in axes},
        tuple(number for label in kept for number in _agreements(label, axes)),
    )


def _may_be_shared(effect: Effect) -> bool:
    """True if the effect is a noise process, or a modifier that acts on the whole record, such as a filter."""
    return isinstance(effect, (Stochastic, Modifier)) and not excludes_or_changes_level(effect)


class _Axis:
    """Column with its fit, effects and estimates; effects and estimates are dicts by labels that all axes share."""

    def __init__(self, column: str, fit: Fit, labels: Sequence[str]) -> None:
        self.column, self.fit = column, fit
        self.effects = dict(zip(labels, fit.model, strict=True))
        self.values = dict(zip(labels, fit.estimates, strict=True))

    def detects(self, label: str) -> bool:
        """True if the model of this axis has the effect with this `label`, and the fit detects it.

        A noise process is detected if its coefficient is; effects of other kinds are always detected.
        """
        effect = self.effects.get(label)
        if not isinstance(effect, Stochastic):
            return effect is not None
        found = self.values[label].get(effect.coefficient)
        return not isinstance(found, Estimate) or found.detected

    def other_detected(self, kept: Sequence[str]) -> tuple[str, ...]:
        """Tuple of the short names of the effects that the axis detects and whose labels are not in `kept`."""
        return tuple(
            effect.short
            for label, effect in self.effects.items()
            if label not in kept and self.detects(label)
        )

    def allows(self, label: str, other: _Axis) -> bool:
        """True if the record of this axis is compatible with the effect `label` at the values that the `other` axis has.

        The effect is added (or replaces the own one) with fixed values; a noise coefficient is the lower end of its 95
        % interval on the `other` axis. The other effects are fitted again. True if logL is at most 1.92 (½ χ²₁, 95 %)
        lower than before. False without a fit if the model of this axis lacks the effect and is not adequate.
        """
        if label not in self.effects and not self.fit.adequate:
            return False
        effect = other.effects[label]
        least = {}
        if isinstance(effect, Stochastic):
            name = effect.coefficient
            value = other.values[label].get(name)
            known = isinstance(value, Estimate) and value.interval
            low = known[0] if known else getattr(effect, name)
            least[name] = low * conversion(other.fit.recording.unit, self.fit.recording.unit)
        names = tuple(p.name for p in effect.parameters if p.role != "derived")
        given = effect.with_values(**least, hold=names, limits={}, at_limit=())
        remaining = (e for e in self.fit.model if e is not self.effects.get(label))
        model = Model((*remaining, given))
        threshold = self.fit.solution.log_likelihood - HALF_CHI2_95
        # With fixed shapes, logL is a lower bound. The full fit is needed only if the bound is a little too low.
        rough = solve(self.fit.data, model, like=self.fit.solution, polish=False)
        if not -MAX_POLISH_DELTA_LOGL < rough.log_likelihood - threshold < 0.0:
            return rough.log_likelihood >= threshold
        return refitted(self.fit, model).solution.log_likelihood >= threshold


def _belongs_to_form(label: str, axes: Sequence[_Axis]) -> bool:
    """True if all axes can share the effect `label`, so that it belongs to their common model.

    The record of each axis that does not detect it must allow the values of one that does. If no axis detects it, all
    models must contain it.
    """
    detecting = [axis for axis in axes if axis.detects(label)]
    if not detecting:
        return all(label in axis.effects for axis in axes)
    others = [axis for axis in axes if axis not in detecting]
    return all(any(axis.allows(label, one) for one in detecting) for axis in others)


def _agreements(label: str, axes: Sequence[_Axis]) -> Iterator[Agreement]:
    """Yield an `Agreement` for each parameter of the effect `label`: mean over the axes, and p-value of equality.

    Only axes that detect the effect and have a standard error of the parameter are compared.
    """
    detecting = [axis for axis in axes if axis.detects(label)]
    for parameter in detecting[0].effects[label].parameters if detecting else ():
        found = {axis: axis.values[label].get(parameter.name) for axis in detecting}
        known = {
            axis: value
            for axis, value in found.items()
            if isinstance(value, Estimate) and value.detected and value.std_error
        }
        if parameter.role == "derived" or len(known) < 2:
            continue
        unit = next(iter(known.values())).unit
        try:
            estimates = [value.to(unit) for value in known.values()]
        except InputError:
            # Levels of power laws with different exponents have different dimensions.
            continue
        pooled = pooled_by_errors(parameter_label(label, parameter.name), estimates)
        yield Agreement(pooled, tuple(axis.column for axis in known), parameter)


def labels_of(models: Sequence[Model]) -> list[tuple[str, ...]]:
    """Labels of the effects of each model, such as ``GM`` or ``SIN2``, equal for corresponding effects of different axes.

    If a model has several effects of one kind, labels are numbered by ascending first shape parameter on the axis with
    the most effects of this kind.
    """
    shapes_of: dict[str, list[float]] = {}
    for model in models:
        for kind in Counter(e.kind for e in model):
            shapes = sorted(_first_shape(e) for e in model if e.kind == kind)
            shapes_of[kind] = max(shapes_of.get(kind, []), shapes, key=len)
    return [_labels_of_model(model, shapes_of) for model in models]


def _labels_of_model(model: Model, shapes_of: Mapping[str, Sequence[float]]) -> tuple[str, ...]:
    """Labels of the effects of a model, such as ``SIN`` and ``SIN2``.

    `shapes_of` maps a kind of effect to the log frequencies (or other first shapes) of label ``SIN``, ``SIN2``, and so
    on. The sum of the distances |ln shape − given value| is least.
    """
    from scipy.optimize import linear_sum_assignment

    labels = [effect.short for effect in model]
    for kind, known in shapes_of.items():
        places = [i for i, e in enumerate(model) if e.kind == kind]
        own = np.array([_first_shape(model.effects[i]) for i in places])
        for at, number in zip(*linear_sum_assignment(np.abs(own[:, None] - known)), strict=True):
            labels[places[at]] += "" if number == 0 else str(number + 1)
    return tuple(labels)


def _first_shape(effect: Effect) -> float:
    """Natural logarithm of the first free shape parameter of an effect; 0 if none, or if it is not a positive float."""
    first = next((effect.values[name] for name in effect.free_shapes), None)
    return float(np.log(first)) if isinstance(first, float) and first > 0.0 else 0.0

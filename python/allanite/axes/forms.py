"""One model form for the axes of a sensor, and whether its coefficients agree between them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.parameters import Estimate
from allanite.effects import Effect, Model, Modifier, Stochastic
from allanite.fit import refitted
from allanite.fit.several.many import by_errors

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.fit.result import Fit
    from allanite.fit.several.many import Pooled

__all__ = ["Form", "common_form", "labels_of"]

#: By how much ln(evidence) may be lower than that of an axis' own model: two are then called equally good.
EQUAL = 2.0
DIFFER = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """A model of the random part that holds for every axis of a sensor.

    Attributes
    ----------
    model : str
        Sum of short names; what an axis has of its own (lines, drifts, outliers) is left to it.
    fits : mapping of str to Fit
        The form fitted to each column, with what is the column's own.
    pooled : tuple of Pooled
        Numbers that every axis shows: the common value, and the probability that they are one.
    """

    model: str
    fits: Mapping[str, Fit]
    pooled: tuple[Pooled, ...]

    @property
    def agree(self) -> bool:
        """Whether no number differs between axes at 5 %, divided by how many there are."""
        return min((p.p_value for p in self.pooled), default=1.0) * len(self.pooled) >= DIFFER

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "model": self.model,
            "agree": self.agree,
            "parameters": [p.to_dict() for p in self.pooled],
        }


def common_form(fits: Mapping[str, Fit]) -> Form | None:
    """The smallest form of the axes' models, or their union, that describes every axis as well as its own model does.

    Parameters
    ----------
    fits : mapping of str to Fit
        Of each column its last model.

    Returns
    -------
    Form or None
        None where no form does, or there is one axis only.
    """
    if len(fits) < 2:
        return None
    for form in _candidates([fit.model for fit in fits.values()]):
        found = _everywhere(form, fits)
        if found is not None:
            name = Model(form).name
            return Form(name, found, _pooled(found))
    return None


def _shared(effect: Effect) -> bool:
    """Whether an effect belongs to the form: neither what happens in one record nor a known function of time."""
    passing = isinstance(effect, Modifier) and (effect.removes or effect.passing)
    return isinstance(effect, (Stochastic, Modifier)) and not passing


def _kinds(effects: Sequence[Effect]) -> Counter[str]:
    return Counter(e.kind for e in effects)


def _candidates(models: Sequence[Model]) -> list[tuple[Effect, ...]]:
    forms = [tuple(e for e in model if _shared(e)) for model in models]
    union: list[Effect] = []
    for form in forms:
        for effect in form:
            if _kinds(union)[effect.kind] < _kinds(form)[effect.kind]:
                union.append(effect)
    different: dict[tuple[tuple[str, int], ...], tuple[Effect, ...]] = {}
    for form in (*sorted(forms, key=len), tuple(union)):
        different.setdefault(tuple(sorted(_kinds(form).items())), form)
    return list(different.values())


def _everywhere(form: tuple[Effect, ...], fits: Mapping[str, Fit]) -> dict[str, Fit] | None:
    out = {}
    for name, own in fits.items():
        fit = _with_form(form, own)
        if fit is None:
            return None
        out[name] = fit
    return out


def _with_form(form: tuple[Effect, ...], own: Fit) -> Fit | None:
    """The form on one axis, or None where the axis' own model is clearly better."""
    mine = tuple(e for e in own.model if _shared(e))
    rest = tuple(e for e in own.model if not _shared(e))
    if _kinds(mine) == _kinds(form):
        return own
    spare = list(mine)
    effects = []
    for effect in form:
        # The axis' own values are the better start.
        at = next((i for i, e in enumerate(spare) if e.kind == effect.kind), None)
        effects.append(effect if at is None else spare.pop(at))
    fit = refitted(own, Model((*effects, *rest)))
    price = 0.5 * float(np.log(max(own.solution.weight.sum(), 2.0)))
    worth = fit.solution.log_likelihood - own.solution.log_likelihood
    worth -= price * (_numbers(form) - _numbers(mine))
    good = worth >= -EQUAL or (fit.adequate and own.adequate)
    return fit if good else None


def _numbers(effects: Sequence[Effect]) -> int:
    return sum(p.role in {"coefficient", "shape"} for e in effects for p in e.parameters)


def _pooled(fits: Mapping[str, Fit]) -> tuple[Pooled, ...]:
    """Numbers of the form that every axis shows, compared by their standard errors in logarithms."""
    labels = labels_of([fit.model for fit in fits.values()])
    tables = [_estimates(fit, own) for fit, own in zip(fits.values(), labels, strict=True)]
    out = []
    for name in tables[0]:
        estimates = [table[name] for table in tables if name in table]
        if len(estimates) == len(tables) and all(e.detected and e.std_error for e in estimates):
            out.append(by_errors(name, estimates[0].unit, estimates))
    return tuple(out)


def _estimates(fit: Fit, labels: Sequence[str]) -> dict[str, Estimate]:
    """Numbers of the form on one axis, by label."""
    table = {}
    for effect, values, label in zip(fit.model, fit.estimates, labels, strict=True):
        if not _shared(effect):
            continue
        for name, value in values.items():
            if isinstance(value, Estimate) and effect.parameter(name).role != "derived":
                table[name if name == label else f"{label}.{name}"] = value
    return table


def labels_of(models: Sequence[Model]) -> list[tuple[str, ...]]:
    """Labels of the effects of each axis, the same for what is one thing on several.

    Of several of a kind the first is that of the lowest first shape, on the axis that has most of them; on another each has
    the label of the one that is nearest to it.
    """
    most: dict[str, list[float]] = {}
    for model in models:
        for kind in _kinds(model.effects):
            shapes = sorted(_first_shape(e) for e in model if e.kind == kind)
            most[kind] = max(most.get(kind, []), shapes, key=len)
    return [_labels(model, most) for model in models]


def _labels(model: Model, most: Mapping[str, Sequence[float]]) -> tuple[str, ...]:
    from scipy.optimize import linear_sum_assignment

    labels = [effect.short for effect in model]
    for kind, known in most.items():
        places = [i for i, e in enumerate(model) if e.kind == kind]
        own = np.array([_first_shape(model.effects[i]) for i in places])
        for at, number in zip(*linear_sum_assignment(np.abs(own[:, None] - known)), strict=True):
            labels[places[at]] += "" if number == 0 else str(number + 1)
    return tuple(labels)


def _first_shape(effect: Effect) -> float:
    """Ln of the first shape; 0 where there is none."""
    shapes = [effect.values[name] for name in effect.free_shapes]
    return (
        float(np.log(shapes[0]))
        if shapes and isinstance(shapes[0], float) and shapes[0] > 0.0
        else 0.0
    )

"""Expected standard errors of a fit, from the Fisher information of its ordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.effects import Deterministic, Effect, Model
from allanite.fit.covariance import spectral_slopes
from allanite.fit.likelihood.expected import density
from allanite.fit.likelihood.whittle import information
from allanite.planning.expected import (
    ordinates_of,
    random_part,
    signal_ordinates,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data


def effect_labels(model: Model) -> list[str]:
    """List of the unique label of each effect of a model: ``N``, ``GM``, and ``GM2`` for a second Gauss-Markov process."""
    seen: dict[str, int] = {}
    out = []
    for effect in model:
        seen[effect.short] = seen.get(effect.short, 0) + 1
        number = seen[effect.short]
        out.append(effect.short if number == 1 else f"{effect.short}{number}")
    return out


def standard_errors(model: Model, data: Data, grid: Data) -> dict[str, float]:
    """Dict with the standard error of every free parameter at the values of the true model.

    The keys are such as ``N``, ``GM.q_c``, ``GM.correlation_time``. An error is in the unit of its parameter, and infinite
    if the record does not show it. `data` and `grid` are from `expected.blank_data` and `expected.coarse_data`.
    """
    names = effect_labels(model)
    out = _errors_of_random_part(model, names, data)
    for part in _groups_sharing_ordinates(model, names):
        out |= _errors_of_known_functions(part, data, grid, random_part(model))
    return {
        key: out[key]
        for label, effect in zip(names, model, strict=True)
        for p in effect.parameters
        if (key := _parameter_key(label, effect, p.name)) in out
    }


def _parameter_key(label: str, effect: Effect, name: str) -> str:
    """Key of a parameter in `standard_errors`: ``GM.q_c``, or ``N`` alone if effect and coefficient have the same name."""
    return label if name == effect.short and label == name else f"{label}.{name}"


def _errors_from_information(fisher: Array) -> Array:
    """Array: standard errors from a Fisher information matrix; infinite for a parameter without information."""
    scale = np.sqrt(np.diag(fisher))
    empty = scale <= 0.0
    scale = np.where(empty, 1.0, scale)
    unit = fisher / np.outer(scale, scale)
    unit[empty, empty] = 1.0
    inverse = np.linalg.pinv(unit, rcond=1e-12, hermitian=True)
    return np.where(empty, np.inf, np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale)


def _errors_of_random_part(model: Model, names: list[str], data: Data) -> dict[str, float]:
    """Dict from the name of each free parameter of processes and modifiers to its standard error.

    Parameters with the value 0 are omitted. An error is infinite if the record does not show the parameter.
    """
    parameters, slopes = spectral_slopes(model, data)
    if not parameters:
        return {}
    relative = _errors_from_information(information(data.bins.count, data.bins.count, slopes))
    out = {}
    for (place, name), error in zip(parameters, relative.tolist(), strict=True):
        effect = model.effects[place]
        # Slopes are by ln(parameter), or by the parameter itself if it may be negative.
        size = 1.0 if effect.parameter(name).low < 0.0 else effect.values[name]
        out[_parameter_key(names[place], effect, name)] = error * size
    return out


def _groups_sharing_ordinates(
    model: Model, names: list[str]
) -> Iterator[list[tuple[str, Deterministic]]]:
    """Iterator over lists of (name, effect): the known functions of time, grouped by the frequencies that they occupy.

    Each function that is not slow (such as a line) is a list of its own. All slow functions together are the last list.
    """
    known = [(n, e) for n, e in zip(names, model, strict=True) if isinstance(e, Deterministic)]
    for one in known:
        if not one[1].low:
            yield [one]
    slow = [one for one in known if one[1].low]
    if slow:
        yield slow


def _errors_of_known_functions(
    effects: list[tuple[str, Deterministic]], data: Data, grid: Data, noise: Model
) -> dict[str, float]:
    """Dict from key (``SIN.frequency``) to standard error, for the parameters of known functions that are fitted together.

    `effects` are pairs (label, function) with the same ordinates of the record `data`. Omitted are held parameters, those
    without a value, and optional ones that are 0 (except angles). The error of the time of a jump comes from `shape_error`,
    because this time has no Fisher information.
    """
    j = ordinates_of(effects[0][1], data, grid)
    root = 1.0 / np.sqrt(density(data.terms(noise), j, data.n))
    keys, slopes = [], []
    own: list[Effect | None] = []
    for label, effect in effects:
        for p in effect.parameters:
            value = effect.values[p.name]
            if p.role not in {"coefficient", "shape"} or p.name in effect.held:
                continue
            # An absent parameter has no error; an angle of 0 is present.
            if value is None or (p.optional and value == 0.0 and p.unit != "rad"):
                continue
            keys.append(_parameter_key(label, effect, p.name))
            # A change point has no Fisher information; the effect gives the law of its error.
            if p.role == "shape" and effect.shape_error(p.name, 1.0, data.duration) is not None:
                own.append(effect)
                slopes.append(np.zeros(j.size))
                continue
            own.append(None)
            step = 1e-3 / data.duration if p.name == "frequency" else 1e-3 * (abs(value) or 1.0)
            high, low = (effect.with_values(**{p.name: value + s}) for s in (step, -step))
            up, down = (signal_ordinates(e, j, data, grid) for e in (high, low))
            slopes.append((up - down) / (2.0 * step) * root)
    if not keys:
        return {}
    matrix = np.column_stack(slopes)
    errors = _errors_from_information(matrix.T @ matrix)
    for i, one in enumerate(own):
        if one is not None:
            name, variance = keys[i].rpartition(".")[2], float(errors[i + 1]) ** 2
            errors[i] = one.shape_error(name, variance, data.duration)
    return dict(zip(keys, map(float, errors), strict=True))

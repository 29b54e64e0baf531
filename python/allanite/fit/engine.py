"""The Whittle fit: coefficients, shapes and deterministic effects together.

Stochastic coefficients are found by `whittle.maximise` at given shapes; shapes by a scan where they have no value and a
bounded polish; deterministic amplitudes by GLS, alternating with the spectrum until logL settles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.effects import Deterministic, Effect, Model, Stochastic
from allanite.fit import shape as _shape
from allanite.fit.data import columns, density
from allanite.fit.deterministic import Design, Regression, design_of, regress
from allanite.fit.whittle import Maximum, log_likelihood, maximise

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["Solution", "at_shapes", "solve", "with_coefficients"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A fitted model with all that later steps need.

    Attributes
    ----------
    model : Model
        With fitted values.
    columns : ndarray, shape (bins, stochastic effects)
        Expected bin power at coefficient 1.
    theta : ndarray, shape (stochastic effects,)
        Squared coefficients.
    spectrum, power : ndarray, shape (bins,)
        Expected and measured bin power (deterministic effects taken out), U² per sample.
    count : ndarray, shape (bins,)
        Degrees of freedom of each bin: ordinates less what the regression used.
    ordinates : ndarray, shape (n,)
        Residual ordinates.
    """

    model: Model
    columns: Array
    theta: Array
    spectrum: Array
    power: Array
    count: Array
    ordinates: Array
    log_likelihood: float
    design: Design | None = None
    regression: Regression | None = None

    __repr__ = brief


def _held(model: Model) -> list[bool]:
    return [e.coefficient in e.held for e in model.stochastic]


def _maximise(model: Model, power: Array, count: Array, data: Data) -> tuple[Maximum, Array]:
    """Coefficients at the model's present shapes; held ones stay."""
    effects = model.stochastic
    matrix = columns(model, effects, data)
    held = np.array(_held(model))
    if not held.any():
        return maximise(power, count, matrix), matrix
    fixed = np.array([getattr(e, e.coefficient) or 0.0 for e in effects]) ** 2
    offset = matrix[:, held] @ fixed[held]
    theta = np.where(held, fixed, 0.0)
    if held.all():
        spectrum = np.maximum(offset, 1e-300)
        return Maximum(theta, spectrum, log_likelihood(power, count, spectrum)), matrix
    found = maximise(power, count, matrix[:, ~held], offset=offset)
    theta[~held] = found.theta
    return Maximum(theta, found.spectrum, found.log_likelihood), matrix


def at_shapes(model: Model, power: Array, count: Array, data: Data) -> Maximum:
    """Coefficients of the random effects at the model's present shapes, for this bin power; held ones stay."""
    return _maximise(model, power, count, data)[0]


def solve(data: Data, model: Model, *, polish: bool = True, rounds: int = 8) -> Solution:
    """Fit all free values of `model` to `data`.

    Parameters
    ----------
    data : Data
    model : Model
        Values are starting values; None is found by a scan. Held values stay.
    polish : bool
        False keeps shapes at their (scanned) starting values.
    rounds : int
        Most alternations between spectrum and regression.
    """
    model = _with_white(model)
    bins = data.bins
    ordinates, count = data.ordinates, bins.count
    power = bins.power(ordinates)
    design: Design | None = None
    regression: Regression | None = None
    best, matrix = Maximum(np.zeros(0), power, -np.inf), np.zeros((power.size, 0))
    previous = -np.inf
    for turn in range(rounds):
        model = _shape.fit_shapes(
            model,
            partial(at_shapes, power=power, count=count, data=data),
            data,
            polish=polish,
        )
        best, matrix = _maximise(model, power, count, data)
        model = with_coefficients(model, best.theta)
        if not model.deterministic:
            break
        model = _shape.fit_deterministic_shapes(model, data, slow=polish and turn < 2)
        design = design_of(model.deterministic, data)
        variance = density(data.terms(model), design.ordinates, data.n)
        regression = _regress(model.deterministic, design, data, variance)
        model = _with_amplitudes(model, design, regression)
        ordinates = data.without(data.signal(model.deterministic))
        used = np.zeros(bins.count.size)
        np.add.at(
            used,
            np.searchsorted(bins.edges, design.ordinates, side="right") - 1,
            regression.leverage,
        )
        count = np.maximum(bins.count - used, 0.05)
        power = bins.power(ordinates) * bins.count / count
        value = log_likelihood(bins.power(ordinates), bins.count, best.spectrum)
        if abs(value - previous) < 1e-3 and turn > 0:
            break
        previous = value
    total = log_likelihood(bins.power(ordinates), bins.count, best.spectrum)
    return Solution(
        model, matrix, best.theta, best.spectrum, power, count, ordinates, total, design, regression
    )


def _with_white(model: Model) -> Model:
    """Shapes without value in deterministic effects are found in the data, so nothing to do unless empty."""
    if not model.stochastic:
        from allanite.effects.angle_random_walk import AngleRandomWalk

        return Model((AngleRandomWalk(), *model.effects))
    return model


def with_coefficients(model: Model, theta: Array) -> Model:
    """The model with these squared coefficients; held ones stay."""
    values = iter(theta)
    effects: list[Effect] = []
    for effect in model.effects:
        if isinstance(effect, Stochastic):
            value = float(np.sqrt(next(values)))
            if effect.coefficient not in effect.held:
                effect = effect.with_values(**{effect.coefficient: value})
        effects.append(effect)
    return Model(tuple(effects))


def _regress(
    effects: tuple[Deterministic, ...], design: Design, data: Data, variance: Array
) -> Regression:
    """GLS of the amplitudes; those of effects with a held amplitude are taken out beforehand."""
    values = data.ordinates[design.ordinates]
    held = np.array(
        [bool(set(effects[i].held) & _amplitude_names(effects[i])) for i in design.owner]
    )
    if not held.any():
        return regress(design.matrix, values, variance)
    fixed = np.concatenate([e.amplitudes() for e in effects])
    rest = regress(design.matrix[:, ~held], values - design.matrix[:, held] @ fixed[held], variance)
    covariance = np.zeros((held.size, held.size))
    covariance[np.ix_(~held, ~held)] = rest.covariance
    amplitudes = np.where(held, fixed, 0.0)
    amplitudes[~held] = rest.amplitudes
    return replace(rest, amplitudes=amplitudes, covariance=covariance)


def _amplitude_names(effect: Effect) -> set[str]:
    return {p.name for p in effect.parameters if p.role == "coefficient"}


def _with_amplitudes(model: Model, design: Design, regression: Regression) -> Model:
    owner = np.array(design.owner)
    index = 0
    effects: list[Effect] = []
    for effect in model.effects:
        if isinstance(effect, Deterministic):
            effect = effect.with_amplitudes(regression.amplitudes[owner == index])
            index += 1
        effects.append(effect)
    return Model(tuple(effects))

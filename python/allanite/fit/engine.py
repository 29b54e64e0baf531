"""Fit all parameters of a model: coefficients, shapes, discrepancy and deterministic effects.

Coefficients and shapes of random effects are optimized together (`polish`); shapes without a start value first by a grid
search. Deterministic amplitudes are estimated by GLS, alternating with the spectrum until logL converges. Parameters beyond
their limits are then held at the limits (`limited`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import Deterministic, Effect, Model, Stochastic, white_noise
from allanite.fit.likelihood.changing_power import effective_freedom
from allanite.fit.likelihood.discrepancy import best_scale, bin_levels
from allanite.fit.likelihood.expected import Noise
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.shapes.deterministic import (
    Design,
    Regression,
    design_of,
    parts_of,
    regress_designs,
    union,
)
from allanite.fit.shapes.limited import within_limits
from allanite.fit.shapes.narrow import fit_narrow_bands, ordinates_delta_logl
from allanite.fit.shapes.shape import fit_deterministic_shapes, fit_shapes, with_open_shapes
from allanite.fit.solution import Regressed, Residual, Solution, fitted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whittle import Maximum

#: Maximum change of an amplitude, in standard errors, for which the residual is not recomputed. It costs ½·0.045² = 1e-3
#: of logL, the change at which a fit ends.
MAX_KEPT_CHANGE = 0.045
#: Regression of a model without functions of time.
NO_REGRESSION = Regression(np.zeros(0), np.zeros((0, 0)), np.zeros(0), 0.0)


def solve(
    data: Data,
    model: Model,
    *,
    start: Maximum | None = None,
    like: Solution | None = None,
    polish: bool = True,
    settled: int = 0,
    rounds: int = 8,
) -> Solution:
    """`Solution` with all free values of `model` fitted to `data`; a model without random effects gets white noise.

    Values of `model` are start values; None is found by a grid search. Held values and limits are respected. `start` is a
    maximum of this model, or of the model without its last random effect. `like` is another fit of the same data, whose
    residual ordinates are reused.

    Without `polish`, shapes keep their start or grid values. Exceptions are a narrow band that is the last effect, and the
    bands that overlap it. Deterministic effects and narrow bands among the first `settled` effects keep their shapes, which
    saves time if an additional effect is only tried. Narrow bands that overlap a later effect are optimized nevertheless.
    `rounds` limits the alternations between spectrum and regression.
    """
    if not model.stochastic:
        model = Model((white_noise(), *model.effects))
    return within_limits(
        model, lambda tried: _fit(data, tried, start, like, polish, settled, rounds)
    )


def _fit(
    data: Data,
    model: Model,
    start: Maximum | None,
    like: Solution | None,
    polish: bool,
    settled: int,
    rounds: int,
) -> Solution:
    """`Solution` of a model as for `solve`, but coefficients and amplitudes may leave the limits that the user gave.

    A round fits the random effects and then the functions of time. A model without functions of time needs one round. Other
    fits end when logL changes by less than 1e-3, when the residual stays the same, or after `rounds`.
    """
    given, free = model, effective_freedom(model, data)
    if not polish:
        settled = max(settled, len(model) - 1)
    part = whole = RandomPart(data, data.power, free)
    functions, ordinates = _Functions(), data.ordinates
    removed: tuple[Deterministic, ...] = ()
    kept: tuple[Deterministic, ...] = ()
    if like is not None and model.deterministic:
        removed, ordinates = like.removed_functions, like.ordinates
        part = RandomPart(data, like.power, np.minimum(like.count, free))
    before = ordinates
    best = start if start is not None else _maximum_from_values(model, part)
    total, previous = -np.inf, -np.inf
    for turn in range(rounds):
        if turn == 1 and polish:
            # Search shapes again: in the first round they may have imitated the still unknown functions of time.
            reopened = with_open_shapes(model, given)
            model, best = reopened, best if reopened.effects == model.effects else None
        model, best = fit_shapes(model, part, best, polished=polish)
        model = with_coefficients(model, best.theta)
        model, best = fit_narrow_bands(model, best, part, ordinates, settled)
        model = with_coefficients(model, best.theta)
        if model.deterministic:
            # Use the discrepancy only from the second round on, when known functions of time no longer cause it.
            scale = best.scale if turn else None
            level = bin_levels(part.power, part.count, best.spectrum, scale)
            noise = Noise(data.terms(model), data.bins, level)
            tried = model.deterministic
            model = fit_deterministic_shapes(
                model, noise, data, polished=polish, settled=settled, kept=kept
            )
            # A line that one of the rounds with a discrepancy does not move is at its maximum.
            kept = tried if turn else ()
            functions = functions.refitted(model.deterministic, noise, data)
            model = _with_replaced(model, Deterministic, iter(functions.effects))
            before = ordinates
            removed, ordinates = _with_subtracted(functions, removed, ordinates, data)
            whole = RandomPart(data, data.bins.power(ordinates), free)
            part = functions.without_leverage(whole)
        total = whole.log_likelihood_of(best) + ordinates_delta_logl(model, data, ordinates, free)
        is_settled = turn > 0 and (abs(total - previous) < 1e-3 or ordinates is before)
        if is_settled or not model.deterministic:
            break
        previous = total
    assert best is not None
    residual = Residual(data, removed).with_cached(ordinates)
    return _solution(model, best, part, functions, residual, total)


def _solution(
    model: Model,
    best: Maximum,
    part: RandomPart,
    functions: _Functions,
    residual: Residual,
    total: float,
) -> Solution:
    """`Solution` made from the last round of a fit.

    `best` is the maximum of the likelihood for the spectrum `part`, without the leverage of the `functions` of time.
    `total` is the logL of the whole record.
    """
    return Solution(
        fitted(model, best.theta, part.linear(model).matrix, functions.fitted(residual.removed)),
        best.spectrum,
        best.weight,
        best.scale,
        best.log_likelihood,
        part.power,
        part.count,
        residual,
        total,
        functions.ordinates,
        functions.regression.leverage,
    )


@dataclass(frozen=True, slots=True)
class _Functions:
    """Known functions of time of a model with their regression on the ordinates of a record.

    `effects` have the fitted amplitudes, `designs` the regressors of each. `ordinates` are all of `designs`, ascending.
    """

    effects: tuple[Deterministic, ...] = ()
    designs: tuple[Design, ...] = ()
    ordinates: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    regression: Regression = NO_REGRESSION

    def refitted(self, effects: tuple[Deterministic, ...], noise: Noise, data: Data) -> _Functions:
        """`_Functions` of `effects` with fitted amplitudes; regressors are reused if the shapes have not changed."""
        before = list(zip(self.effects, self.designs, strict=True))
        designs = tuple(
            next((d for old, d in before if old.seen_alike == e.seen_alike), None)
            or design_of((e,), data)
            for e in effects
        )
        at = union([design.ordinates for design in designs])
        regression = _regress(effects, designs, at, data, noise.variance(at))
        made = (
            e.with_amplitudes(regression.amplitudes[own])
            for e, own in zip(effects, parts_of(designs), strict=True)
        )
        return _Functions(tuple(made), designs, at, regression)

    def without_leverage(self, whole: RandomPart) -> RandomPart:
        """`RandomPart` (bin power, degrees of freedom) of `whole`, minus the degrees of freedom that the regression used.

        A bin keeps at least 0.05 degrees of freedom, or all if it has fewer.
        """
        edges = whole.data.bins.edges
        used = np.zeros(whole.count.size)
        place = np.searchsorted(edges, self.ordinates, side="right") - 1
        np.add.at(used, place, self.regression.leverage)
        count = np.maximum(whole.count - used, np.minimum(whole.count, 0.05))
        return RandomPart(whole.data, whole.power * whole.count / count, count)

    def fitted(self, removed: tuple[Deterministic, ...]) -> tuple[Regressed, ...]:
        """Tuple with a `Regressed` (fitted function with amplitudes, covariance and regressors) for each function of time.

        `removed` holds for each function the copy that is subtracted from the residual, whose amplitudes can differ
        slightly.
        """
        found = self.regression
        each = zip(self.effects, self.designs, parts_of(self.designs), removed, strict=True)
        return tuple(
            Regressed(
                e, found.amplitudes[own], found.covariance[own, own], d.matrix, out, d.ordinates
            )
            for e, d, own, out in each
        )


def _with_subtracted(
    functions: _Functions, removed: tuple[Deterministic, ...], ordinates: Array, data: Data
) -> tuple[tuple[Deterministic, ...], Array]:
    """Pair: functions that are subtracted from the record now, and the residual ordinates, shape (n,).

    The current `functions` are subtracted instead of those in `removed`, which are already subtracted from `ordinates`. A
    function keeps its old amplitudes if all its new amplitudes differ from them by at most 0.045 standard errors.
    """
    scatter = np.sqrt(np.diag(functions.regression.covariance))
    before, changes, now = list(removed), [], []
    for effect, own in zip(functions.effects, parts_of(functions.designs), strict=True):
        change = effect.amplitudes()
        alike = [k for k, e in enumerate(before) if e.seen_alike == effect.seen_alike]
        if alike:
            old = before.pop(alike[0])
            change = change - old.amplitudes()
            if (np.abs(change) <= MAX_KEPT_CHANGE * scatter[own]).all():
                now.append(old)
                continue
        changes.append((effect, change))
        now.append(effect)
    changes += [(old, -old.amplitudes()) for old in before]
    return tuple(now), data.minus_functions(ordinates, changes)


def _maximum_from_values(model: Model, part: RandomPart) -> Maximum | None:
    """Local `Maximum` of the likelihood, with a fitted discrepancy, that is reached from the model's values.

    None if a value is missing, or if all coefficients are 0.
    """
    known = [getattr(e, e.coefficient) for e in model.stochastic]
    shapes = [e.values[n] for e in model if not isinstance(e, Deterministic) for n in e.free_shapes]
    if any(v is None for v in [*known, *shapes]) or not any(known):
        return None
    theta = np.array(known, dtype=float) ** 2
    linear = part.linear(model)
    scale, _ = best_scale(part.power, part.count, np.maximum(linear.matrix @ theta, 1e-300))
    return part.climb(linear, theta, scale)


def with_coefficients(model: Model, theta: Array) -> Model:
    """Copy of the model with the squared coefficients `theta`; held coefficients stay."""
    return _with_replaced(
        model,
        Stochastic,
        (
            effect
            if effect.coefficient in effect.held
            else effect.with_values(**{effect.coefficient: float(np.sqrt(square))})
            for effect, square in zip(model.stochastic, theta, strict=True)
        ),
    )


def _with_replaced(model: Model, base: type[Effect], effects: Iterator[Effect]) -> Model:
    """Copy of the model in which each effect of class `base` is replaced by the next element of `effects`, in order."""
    return Model(tuple(next(effects) if isinstance(e, base) else e for e in model))


def _regress(
    effects: tuple[Deterministic, ...],
    designs: tuple[Design, ...],
    at: NDArray[np.int64],
    data: Data,
    variance: Array,
) -> Regression:
    """`Regression` of the record's ordinates `at` on functions of time, weighted by 1/`variance`.

    Held amplitudes are subtracted first; they keep their values and have the covariance 0.
    """
    fixed, values = [e.amplitudes() for e in effects], data.ordinates[at]
    held = np.repeat([e.amplitudes_held for e in effects], [a.size for a in fixed])
    for effect, design, amplitudes in zip(effects, designs, fixed, strict=True):
        if effect.amplitudes_held:
            values[np.searchsorted(at, design.ordinates)] -= design.matrix @ amplitudes
    free = [d for e, d in zip(effects, designs, strict=True) if not e.amplitudes_held]
    if not held.any():
        return regress_designs(designs, at, values, variance)
    of_free = regress_designs(free, at, values, variance)
    covariance = np.zeros((held.size, held.size))
    covariance[np.ix_(~held, ~held)] = of_free.covariance
    amplitudes = np.where(held, np.concatenate(fixed), 0.0)
    amplitudes[~held] = of_free.amplitudes
    return replace(of_free, amplitudes=amplitudes, covariance=covariance)

"""Fit all parameters of a model: coefficients, shapes, discrepancy and deterministic effects.

Coefficients and shapes of random effects are optimized together (`polish`); shapes without a start value first by a grid
search. Deterministic amplitudes are estimated by GLS, alternating with the spectrum until logL converges. Parameters beyond
their limits are then held at the limits (`limited`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.effects import Deterministic, Effect, Model, Stochastic, white_noise
from allanite.fit.likelihood.changing_power import effective_freedom
from allanite.fit.likelihood.discrepancy import best_scale, bin_levels
from allanite.fit.likelihood.expected import Noise
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.shapes.deterministic import Design, Regression, design_of, regress, regressors_at
from allanite.fit.shapes.limited import within_limits
from allanite.fit.shapes.narrow import fit_narrow_bands, ordinates_delta_logl
from allanite.fit.shapes.shape import fit_deterministic_shapes, fit_shapes, with_open_shapes
from allanite.fit.solution import Regressed, Residual, Solution, fitted, processes_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whittle import Maximum

#: Maximum change of an amplitude, in standard errors, for which the residual is not recomputed. It costs ½·0.01² = 5e-5
#: of logL.
MAX_KEPT_CHANGE = 0.01
#: The same maximum if an additional effect is only tried; it costs 5e-3 of logL.
MAX_KEPT_CHANGE_TRIED = 0.1
#: Maximum amplitude of a tried function, in standard errors, up to which it is removed only at the ordinates of its
#: regression. The part of such a line or step at other ordinates is worth about 0.03 of logL.
MAX_FAINT_AMPLITUDE = 12.0
#: Design and regression of a model without functions of time.
NO_DESIGN = Design(np.zeros(0, dtype=np.int64), np.zeros((0, 0)), ())
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
    """`Solution` with all free values of `model` fitted to `data`.

    White noise is added to a model without random effects.

    Parameters
    ----------
    data : Data
    model : Model
        Values are start values; None is found by a grid search. Held values and limits are respected.
    start : Maximum, optional
        Start: a maximum of this model, or of the model without its last random effect.
    like : Solution, optional
        Another fit of the same data, whose residual ordinates are reused.
    polish : bool
        False keeps shapes at their start or grid values. Exceptions are a narrow band that is the last effect of the
        model, and the bands that overlap it.
    settled : int
        Deterministic effects and narrow bands among the first `settled` effects keep their shapes. This is used if an
        additional effect is only tried. Narrow bands that overlap a later effect are optimized nevertheless.
    rounds : int
        Maximum alternations between spectrum and regression.

    Returns
    -------
    Solution
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

    The arguments are those of `solve`. A round fits the random effects and then the functions of time. A model without
    functions of time needs one round. Other fits end when logL changes by less than 1e-3, when the residual stays the
    same, or after `rounds`.
    """
    given = model
    free = effective_freedom(model, data)
    if not polish:
        settled = max(settled, len(model) - 1)
    part = whole = RandomPart(data, data.power, free)
    functions, residual = _Functions(), _ResidualOrdinates((), data.ordinates, ())
    if like is not None and model.deterministic:
        removed = like.removed_functions
        residual = _ResidualOrdinates(removed, like.ordinates, (False,) * len(removed))
        part = RandomPart(data, like.power, np.minimum(like.count, free))
    ordinates = before = residual.ordinates
    best = start if start is not None else _maximum_from_values(model, part)
    total, previous = -np.inf, -np.inf
    for turn in range(rounds):
        # Search shapes again: in the first round they may have imitated the still unknown functions of time.
        reopened = with_open_shapes(model, given) if turn == 1 and polish else None
        model, best = _fit_random_effects(model, reopened, best, part, ordinates, polish, settled)
        if model.deterministic:
            # Use the discrepancy only from the second round on, when known functions of time no longer cause it.
            scale = best.scale if turn else None
            level = bin_levels(part.power, part.count, best.spectrum, scale)
            noise = Noise(data.terms(model), data.bins, level)
            model = fit_deterministic_shapes(
                model, noise, data, lines=polish, slow=polish and turn < 4, settled=settled
            )
            functions = functions.refitted(model.deterministic, noise, data)
            model = _with_replaced(model, Deterministic, iter(functions.effects))
            before = residual.ordinates
            residual = residual.with_removed(functions, data, settled > 0)
            ordinates = residual.ordinates
            whole = RandomPart(data, data.bins.power(ordinates), free)
            part = functions.without_leverage(whole)
        total = whole.log_likelihood_of(best) + ordinates_delta_logl(model, data, ordinates, free)
        is_settled = turn > 0 and (abs(total - previous) < 1e-3 or ordinates is before)
        if is_settled or not model.deterministic:
            break
        previous = total
    assert best is not None
    processes = processes_of(model, best.theta, part.linear(model).matrix)
    return Solution(
        fitted(model, processes, functions.fitted(residual.effects)),
        best.spectrum,
        best.weight,
        best.scale,
        best.log_likelihood,
        part.power,
        part.count,
        Residual(data, residual.effects).with_cached(ordinates),
        total,
        functions.design.ordinates,
        functions.regression.leverage,
    )


def _fit_random_effects(
    model: Model,
    reopened: Model | None,
    start: Maximum | None,
    part: RandomPart,
    ordinates: Array,
    polish: bool,
    settled: int,
) -> tuple[Model, Maximum]:
    """Pair: model with fitted random effects and modifiers, and its `Maximum`; functions of time stay fixed.

    `reopened` is None, or a second model, in which some shapes have no start values. It is fitted too, and the fit with
    the higher logL is used. Narrow bands are then fitted to `ordinates`. For the other arguments see `solve`.
    """
    found = fit_shapes(model, part, start, polished=polish)
    if reopened is not None:
        found = max(found, fit_shapes(reopened, part), key=lambda each: each[1].log_likelihood)
    model, best = found
    model, best = fit_narrow_bands(
        with_coefficients(model, best.theta), best, part, ordinates, settled
    )
    return with_coefficients(model, best.theta), best


@dataclass(frozen=True, slots=True)
class _Functions:
    """Known functions of time of a model with their regression on the ordinates of a record.

    Attributes
    ----------
    effects : tuple of Deterministic
        The functions with fitted amplitudes.
    design : Design
    regression : Regression
    """

    effects: tuple[Deterministic, ...] = ()
    design: Design = NO_DESIGN
    regression: Regression = NO_REGRESSION

    def refitted(self, effects: tuple[Deterministic, ...], noise: Noise, data: Data) -> _Functions:
        """`_Functions` (functions of time, their regressors and their regression) of `effects` with fitted amplitudes.

        The regressors are reused if no shape has changed.
        """
        same = [e.seen_alike for e in self.effects] == [e.seen_alike for e in effects]
        design = self.design if same else design_of(effects, data)
        regression = _regress(effects, design, data, noise.variance(design.ordinates))
        made = (
            e.with_amplitudes(regression.amplitudes[own])
            for e, own in zip(effects, design.parts, strict=True)
        )
        return _Functions(tuple(made), design, regression)

    def without_leverage(self, whole: RandomPart) -> RandomPart:
        """`RandomPart` (bin power, degrees of freedom) of `whole`, minus the degrees of freedom that the regression used.

        The mean power of a bin is multiplied by its old degrees of freedom divided by the new ones. A bin keeps at
        least 0.05 degrees of freedom, or all if it has fewer.
        """
        edges = whole.data.bins.edges
        used = np.zeros(whole.count.size)
        place = np.searchsorted(edges, self.design.ordinates, side="right") - 1
        np.add.at(used, place, self.regression.leverage)
        count = np.maximum(whole.count - used, np.minimum(whole.count, 0.05))
        return RandomPart(whole.data, whole.power * whole.count / count, count)

    def fitted(self, removed: tuple[Deterministic, ...]) -> tuple[Regressed, ...]:
        """Tuple with a `Regressed` (fitted function with amplitudes, covariance and regressors) for each function of time.

        `removed` holds for each function, in the same order, the copy that is subtracted from the residual. The amplitudes
        of this copy can differ slightly from the fitted amplitudes.
        """
        return tuple(
            Regressed(
                effect,
                self.regression.amplitudes[own],
                self.regression.covariance[own, own],
                self.design.matrix[:, own],
                out,
            )
            for effect, own, out in zip(self.effects, self.design.parts, removed, strict=True)
        )


@dataclass(frozen=True, slots=True)
class _ResidualOrdinates:
    """Residual ordinates, and the known functions of time that were removed from them.

    Attributes
    ----------
    effects : tuple of Deterministic
        Functions removed.
    ordinates : ndarray, shape (n,)
        Residual ordinates.
    is_local : tuple of bool
        For each of `effects`: True if it was removed only at the ordinates of the regression.
    """

    effects: tuple[Deterministic, ...]
    ordinates: Array
    is_local: tuple[bool, ...]

    def with_removed(self, functions: _Functions, data: Data, is_tried: bool) -> _ResidualOrdinates:
        """`_ResidualOrdinates` with the current `functions` subtracted instead of those that were subtracted before.

        The old amplitudes of a function remain if none of the new ones differs by more than 0.01 standard errors. A search
        that tries an additional effect sets `is_tried`; the limit is then 0.1 standard errors. In a trial, changes below 12
        standard errors are subtracted only at the ordinates of the regression, except for those of short events.
        """
        scatter = np.sqrt(np.diag(functions.regression.covariance))
        max_change = MAX_KEPT_CHANGE_TRIED if is_tried else MAX_KEPT_CHANGE
        before = list(zip(self.effects, self.is_local, strict=True))
        everywhere: list[tuple[Deterministic, Array]] = []
        nearby: list[tuple[Deterministic, Array]] = []
        now: list[tuple[Deterministic, bool]] = []
        for effect, own in zip(functions.effects, functions.design.parts, strict=True):
            change = effect.amplitudes()
            alike = [k for k, (e, _) in enumerate(before) if e.seen_alike == effect.seen_alike]
            was_local = False
            if alike:
                old, was_local = before.pop(alike[0])
                change = change - old.amplitudes()
                if (np.abs(change) <= max_change * scatter[own]).all():
                    now.append((old, was_local))
                    continue
            is_faint = bool((np.abs(change) < MAX_FAINT_AMPLITUDE * scatter[own]).all())
            # A short event has most of its power at higher ordinates.
            is_short = effect.happens_once and not effect.lasting
            is_local = was_local or (is_tried and is_faint and not is_short)
            (nearby if is_local else everywhere).append((effect, change))
            now.append((effect, is_local and (was_local or not alike)))
        for old, was_local in before:
            (nearby if was_local else everywhere).append((old, -old.amplitudes()))
        left = data.minus_functions(self.ordinates, everywhere)
        if nearby:
            left = left.copy() if left is self.ordinates else left
            j = functions.design.ordinates
            for effect, change in nearby:
                left[j] -= regressors_at(effect, j, data) @ change
        return _ResidualOrdinates(tuple(e for e, _ in now), left, tuple(local for _, local in now))


def _maximum_from_values(model: Model, part: RandomPart) -> Maximum | None:
    """Local `Maximum` of the likelihood, with a fitted discrepancy, that is reached from the model's values.

    None if a value is missing: a coefficient of a random effect, or a free shape of a random effect or modifier. None
    also if all coefficients are 0.
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
    effects: tuple[Deterministic, ...], design: Design, data: Data, variance: Array
) -> Regression:
    """`Regression` of the record's ordinates on functions of time, weighted by 1/`variance`.

    Held amplitudes are subtracted first; they keep their values and have the covariance 0.
    """
    values = data.ordinates[design.ordinates]
    parts = zip(effects, design.parts, strict=True)
    held = np.concatenate([np.full(p.stop - p.start, e.amplitudes_held) for e, p in parts])
    if not held.any():
        return regress(design.matrix, values, variance)
    fixed = np.concatenate([e.amplitudes() for e in effects])
    of_free = regress(
        design.matrix[:, ~held], values - design.matrix[:, held] @ fixed[held], variance
    )
    covariance = np.zeros((held.size, held.size))
    covariance[np.ix_(~held, ~held)] = of_free.covariance
    amplitudes = np.where(held, fixed, 0.0)
    amplitudes[~held] = of_free.amplitudes
    return replace(of_free, amplitudes=amplitudes, covariance=covariance)

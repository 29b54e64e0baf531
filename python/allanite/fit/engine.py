"""The fit: coefficients, shapes, discrepancy and deterministic effects together.

Coefficients and shapes of the random part are climbed together (`polish`), shapes without a value after a scan of their
grid; deterministic amplitudes are found by GLS, alternating with the spectrum until logL settles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.blas import one_thread
from allanite.common.showing import brief
from allanite.effects import Deterministic, Effect, Model, Stochastic
from allanite.fit.data import Noise
from allanite.fit.deterministic import Design, Regression, design_of, regress
from allanite.fit.discrepancy import SCALES, best_scale, levels
from allanite.fit.random_part import RandomPart
from allanite.fit.shape import fit_deterministic_shapes, fit_shapes, reopened

if TYPE_CHECKING:
    from allanite.fit.data import Data
    from allanite.fit.whittle import Maximum

__all__ = ["Solution", "solve", "with_coefficients"]

Array = NDArray[np.float64]
#: An amplitude that moves by less of its standard error is where it was: 5e-5 of logL.
STILL = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A fitted model with all that later steps need.

    Attributes
    ----------
    model : Model
        With fitted values.
    best : Maximum
        Squared coefficients, expected bin power, the scale of the discrepancy and the vote of each bin.
    columns : ndarray, shape (bins, stochastic effects)
        Expected bin power at coefficient 1.
    power : ndarray, shape (bins,)
        Measured bin power (deterministic effects taken out), U² per sample.
    count : ndarray, shape (bins,)
        Degrees of freedom of each bin: ordinates less what the regression used.
    ordinates : ndarray, shape (n,)
        Residual ordinates.
    taken : tuple of Deterministic
        What was taken out of them: the model's known functions to `STILL` of their scatter.
    log_likelihood : float
        Of the whole record: the residual in all its ordinates.
    """

    model: Model
    best: Maximum
    columns: Array
    power: Array
    count: Array
    ordinates: Array
    log_likelihood: float
    taken: tuple[Deterministic, ...] = ()
    design: Design | None = None
    regression: Regression | None = None

    __repr__ = brief

    @property
    def theta(self) -> Array:
        """Squared coefficients, shape (stochastic effects,)."""
        return self.best.theta

    @property
    def spectrum(self) -> Array:
        """Expected bin power, shape (bins,)."""
        return self.best.spectrum

    @property
    def weight(self) -> Array:
        """Effective degrees of freedom of each bin: the vote that it had."""
        return self.best.weight

    @property
    def level(self) -> Array:
        """By how much each bin probably differs from the model, shape (bins,)."""
        return levels(self.power, self.count, self.spectrum, self.best.scale)

    @property
    def discrepancy(self) -> float:
        """Scale of the model's misfit, of ln power; 0 where nothing speaks against the model."""
        return 0.0 if self.best.scale is None else float(SCALES[self.best.scale])

    def noise(self, data: Data) -> Noise:
        """What the random part expects of single ordinates."""
        return Noise(data.terms(self.model), data.bins, self.level)


@one_thread()
def solve(
    data: Data,
    model: Model,
    *,
    start: Maximum | None = None,
    like: Solution | None = None,
    polish: bool = True,
    rounds: int = 8,
) -> Solution:
    """Fit all free values of `model` to `data`.

    Parameters
    ----------
    data : Data
    model : Model
        Values are starting values; None is found by a scan. Held values stay.
    start : Maximum, optional
        Where to look first: a maximum of this model, or of the model without its last random effect.
    like : Solution, optional
        Another of the same data: what it has taken out is not taken out again.
    polish : bool
        False keeps shapes at their (scanned) starting values.
    rounds : int
        Most alternations between spectrum and regression.
    """
    given = model = _with_white(model)
    bins = data.bins
    part = RandomPart(data, bins.power(data.ordinates), bins.count)
    taken = _Taken((), data.ordinates)
    if like is not None and model.deterministic:
        taken = _Taken(like.taken, like.ordinates)
    ordinates = data.ordinates
    design: Design | None = None
    placed: tuple[object, ...] = ()
    regression: Regression | None = None
    best = start if start is not None else _given(model, part)
    total, previous = -np.inf, -np.inf
    for turn in range(rounds):
        again = reopened(model, given) if turn == 1 and polish else None
        model, best = fit_shapes(model, part, best, polished=polish)
        if again is not None:
            # Shapes were looked for before the functions of time were known, which a lag may have stood for.
            anew = fit_shapes(again, part)
            model, best = max((model, best), anew, key=lambda found: found[1].log_likelihood)
        model = with_coefficients(model, best.theta)
        if not model.deterministic:
            break
        # What known functions add to their cells is no discrepancy: it is looked at once they are taken out.
        level = levels(part.power, part.count, best.spectrum, best.scale if turn else None)
        noise = Noise(data.terms(model), bins, level)
        model = fit_deterministic_shapes(model, noise, data, lines=polish, slow=polish and turn < 2)
        shapes = tuple(e.seen_alike for e in model.deterministic)
        if design is None or shapes != placed:
            design, placed = design_of(model.deterministic, data), shapes
        regression = _regress(model.deterministic, design, data, noise.variance(design.ordinates))
        model = _with_amplitudes(model, design, regression)
        scatter = np.sqrt(np.diag(regression.covariance))
        taken = taken.moved(model.deterministic, design, scatter, data)
        ordinates = taken.ordinates
        used = np.zeros(bins.count.size)
        np.add.at(
            used,
            np.searchsorted(bins.edges, design.ordinates, side="right") - 1,
            regression.leverage,
        )
        count = np.maximum(bins.count - used, 0.05)
        raw = bins.power(ordinates)
        part = RandomPart(data, raw * bins.count / count, count)
        total = RandomPart(data, raw, bins.count).judged(best)
        if abs(total - previous) < 1e-3 and turn > 0:
            break
        previous = total
    assert best is not None
    linear = part.linear(model)
    total = RandomPart(data, bins.power(ordinates), bins.count).judged(best)
    return Solution(
        model,
        best,
        linear.matrix,
        part.power,
        part.count,
        ordinates,
        total,
        taken.effects if model.deterministic else (),
        design,
        regression,
    )


@dataclass(frozen=True, slots=True)
class _Taken:
    """Known functions of time that are taken out of ordinates, and what is left."""

    effects: tuple[Deterministic, ...]
    ordinates: Array

    def moved(
        self, effects: tuple[Deterministic, ...], design: Design, scatter: Array, data: Data
    ) -> _Taken:
        """With these taken out instead; an amplitude that moves by less than `STILL` of its scatter stays."""
        before = list(self.effects)
        parts = []
        now = []
        owner = np.array(design.owner)
        for i, effect in enumerate(effects):
            amplitudes = effect.amplitudes()
            old = next((e for e in before if e.seen_alike == effect.seen_alike), None)
            if old is not None:
                before = [e for e in before if e is not old]
                change = amplitudes - old.amplitudes()
                if (np.abs(change) <= STILL * scatter[owner == i]).all():
                    now.append(old)
                    continue
                amplitudes = change
            parts.append((effect, amplitudes))
            now.append(effect)
        parts += [(effect, -effect.amplitudes()) for effect in before]
        return _Taken(tuple(now), data.exchanged(self.ordinates, parts))


def _given(model: Model, part: RandomPart) -> Maximum | None:
    """The maximum uphill of the values that the model already has, with a discrepancy."""
    known = [getattr(e, e.coefficient) for e in model.stochastic]
    shapes = [e.values[n] for e in model if not isinstance(e, Deterministic) for n in e.free_shapes]
    if any(v is None for v in [*known, *shapes]) or not any(known):
        return None
    theta = np.array(known, dtype=float) ** 2
    linear = part.linear(model)
    scale, _ = best_scale(part.power, part.count, np.maximum(linear.matrix @ theta, 1e-300))
    return part.climb(linear, theta, scale)


def _with_white(model: Model) -> Model:
    """Add white noise if the model has no stochastic effect."""
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

"""The fit: coefficients, shapes, discrepancy and deterministic effects together.

Coefficients and shapes of the random part are climbed together (`polish`), shapes without a value after a scan of their
grid; deterministic amplitudes are found by GLS, alternating with the spectrum until logL settles. What is then beyond its
limits is held at them (`limited`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.blas import one_thread
from allanite.effects import Deterministic, Effect, Model, Periodic, Stochastic, white_noise
from allanite.fit.likelihood.crowding import effective_freedom, has_changing_power
from allanite.fit.likelihood.discrepancy import best_scale, bin_levels
from allanite.fit.likelihood.expected import Noise
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.shapes.deterministic import Design, Regression, design_of, regress
from allanite.fit.shapes.limited import within_limits
from allanite.fit.shapes.narrow import fit_narrow_bands, ordinates_delta_logl
from allanite.fit.shapes.shape import fit_deterministic_shapes, fit_shapes, with_open_shapes
from allanite.fit.solution import Regressed, Residual, Solution, fitted, processes_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whittle import Maximum

__all__ = ["Solution", "solve", "with_coefficients"]

Array = NDArray[np.float64]
#: An amplitude that moves by less of its standard error is where it was: 5e-5 of logL; where one more effect is only
#: looked at, 5e-3.
STILL, ROUGHLY = 0.01, 0.1
#: A line of so many standard errors leaves some 0.03 of logL outside its window.
FAINT = 12.0


@one_thread()
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
    """Fit all free values of `model` to `data`.

    Parameters
    ----------
    data : Data
    model : Model
        Values are starting values; None is found by a scan. Held values stay, limits are kept to.
    start : Maximum, optional
        Where to look first: a maximum of this model, or of the model without its last random effect.
    like : Solution, optional
        Another of the same data: what it has taken out is not taken out again.
    polish : bool
        False keeps shapes at their (scanned) starting values, but that of a last narrow band and of those it touches.
    settled : int
        Of so many effects, from the first, known functions of time and narrow bands keep their shapes: where one more is
        only looked at, they are where the record has them. Bands that touch one behind these do move.
    rounds : int
        Most alternations between spectrum and regression.
    """
    model = _with_white(model)

    def fit(tried: Model) -> Solution:
        return _fit(data, tried, start, like, polish, settled, rounds)

    return within_limits(model, fit)


def _fit(
    data: Data,
    model: Model,
    start: Maximum | None,
    like: Solution | None,
    polish: bool,
    settled: int,
    rounds: int,
) -> Solution:
    """`solve` without regard to limits but where shapes are searched."""
    given = model
    bins = data.bins
    free = effective_freedom(model, data) if has_changing_power(model) else bins.count
    if not polish:
        settled = max(settled, len(model) - 1)
    raw = bins.power(data.ordinates)
    part = RandomPart(data, raw, free)
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
        again = with_open_shapes(model, given) if turn == 1 and polish else None
        model, best = fit_shapes(model, part, best, polished=polish)
        if again is not None:
            # Shapes were looked for before the functions of time were known, which a lag may have stood for.
            anew = fit_shapes(again, part)
            model, best = max((model, best), anew, key=lambda found: found[1].log_likelihood)
        model = with_coefficients(model, best.theta)
        model, best = fit_narrow_bands(model, best, part, ordinates, settled)
        model = with_coefficients(model, best.theta)
        if not model.deterministic:
            break
        # What known functions add to their cells is no discrepancy: it is looked at once they are taken out.
        level = bin_levels(part.power, part.count, best.spectrum, best.scale if turn else None)
        noise = Noise(data.terms(model), bins, level)
        slow = polish and turn < 4
        model = fit_deterministic_shapes(
            model, noise, data, lines=polish, slow=slow, settled=settled
        )
        shapes = tuple(e.seen_alike for e in model.deterministic)
        if design is None or shapes != placed:
            design, placed = design_of(model.deterministic, data), shapes
        regression = _regress(model.deterministic, design, data, noise.variance(design.ordinates))
        model = _with_amplitudes(model, design, regression)
        before = taken.ordinates
        taken = taken.moved(model.deterministic, design, regression, data, settled > 0)
        ordinates = taken.ordinates
        used = np.zeros(bins.count.size)
        np.add.at(
            used,
            np.searchsorted(bins.edges, design.ordinates, side="right") - 1,
            regression.leverage,
        )
        count = np.maximum(free - used, np.minimum(free, 0.05))
        raw = bins.power(ordinates)
        part = RandomPart(data, raw * free / count, count)
        total = RandomPart(data, raw, free).judged(best)
        total += ordinates_delta_logl(model, data, ordinates, free)
        if turn > 0 and (abs(total - previous) < 1e-3 or ordinates is before):
            break
        previous = total
    assert best is not None
    linear = part.linear(model)
    if not model.deterministic:
        total = RandomPart(data, raw, free).judged(best) + ordinates_delta_logl(
            model, data, ordinates, free
        )
    processes = processes_of(model, best.theta, linear.matrix)
    functions: tuple[Regressed, ...] = ()
    seen, leverage = np.zeros(0, dtype=np.int64), np.zeros(0)
    if design is not None and regression is not None:
        functions = _functions(model.deterministic, design, regression, taken.effects)
        seen, leverage = design.ordinates, regression.leverage
    return Solution(
        fitted(model, processes, functions),
        best.spectrum,
        best.weight,
        best.scale,
        best.log_likelihood,
        part.power,
        part.count,
        Residual(data, taken.effects).known(ordinates),
        total,
        seen,
        leverage,
    )


def _functions(
    effects: tuple[Deterministic, ...],
    design: Design,
    regression: Regression,
    taken: tuple[Deterministic, ...],
) -> tuple[Regressed, ...]:
    """What a regression found for each of its effects."""
    return tuple(
        Regressed(
            effect,
            regression.amplitudes[own],
            regression.covariance[own, own],
            design.matrix[:, own],
            out,
        )
        for effect, own, out in zip(effects, design.parts, taken, strict=True)
    )


@dataclass(frozen=True, slots=True)
class _Taken:
    """Known functions of time that are taken out of ordinates, and what is left; those `near` where they are looked at."""

    effects: tuple[Deterministic, ...]
    ordinates: Array
    near: tuple[Deterministic, ...] = ()

    def moved(
        self,
        effects: tuple[Deterministic, ...],
        design: Design,
        regression: Regression,
        data: Data,
        looked_at: bool,
    ) -> _Taken:
        """With these taken out instead; amplitudes that hardly move stay.

        Of a faint line that is only looked at, what is beyond its window is less than anyone notices.
        """
        scatter = np.sqrt(np.diag(regression.covariance))
        before = list(self.effects)
        parts, now, near = [], [], []
        for effect, own in zip(effects, design.parts, strict=True):
            amplitudes = effect.amplitudes()
            old = next((e for e in before if e.seen_alike == effect.seen_alike), None)
            was_near = old is not None and _among(old, self.near)
            if old is not None:
                before = [e for e in before if e is not old]
                change = amplitudes - old.amplitudes()
                if (np.abs(change) <= (ROUGHLY if looked_at else STILL) * scatter[own]).all():
                    now.append(old)
                    near += [old] if was_near else []
                    continue
                amplitudes = change
            local = was_near or (
                looked_at
                and isinstance(effect, Periodic)
                and bool((np.abs(amplitudes) < FAINT * scatter[own]).all())
            )
            parts.append((effect, amplitudes, local))
            now.append(effect)
            near += [effect] if local and (old is None or was_near) else []
        parts += [(e, -e.amplitudes(), _among(e, self.near)) for e in before]
        left = data.exchanged(self.ordinates, [(e, a) for e, a, local in parts if not local])
        for effect, amplitudes, local in parts:
            if local:
                j = design.ordinates
                left = left.copy() if left is self.ordinates else left
                left[j] -= design_of((effect,), data, j).matrix @ amplitudes
        return _Taken(tuple(now), left, tuple(near))


def _among(effect: Effect, effects: Sequence[Effect]) -> bool:
    """Whether it is one of these itself."""
    return any(e is effect for e in effects)


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
        return Model((white_noise(), *model.effects))
    return model


def with_coefficients(model: Model, theta: Array) -> Model:
    """The model with these squared coefficients; held ones stay."""
    return _exchanged(
        model,
        Stochastic,
        (
            effect
            if effect.coefficient in effect.held
            else effect.with_values(**{effect.coefficient: float(np.sqrt(square))})
            for effect, square in zip(model.stochastic, theta, strict=True)
        ),
    )


def _with_amplitudes(model: Model, design: Design, regression: Regression) -> Model:
    return _exchanged(
        model,
        Deterministic,
        (
            effect.with_amplitudes(regression.amplitudes[own])
            for effect, own in zip(model.deterministic, design.parts, strict=True)
        ),
    )


def _exchanged(model: Model, base: type[Effect], effects: Iterator[Effect]) -> Model:
    """The model with others in place of its effects of a class, in their order."""
    return Model(tuple(next(effects) if isinstance(e, base) else e for e in model))


def _regress(
    effects: tuple[Deterministic, ...], design: Design, data: Data, variance: Array
) -> Regression:
    """GLS of the amplitudes; those of effects with a held amplitude are taken out beforehand."""
    values = data.ordinates[design.ordinates]
    given = [
        np.full(own.stop - own.start, effect.amplitudes_held)
        for effect, own in zip(effects, design.parts, strict=True)
    ]
    held = np.concatenate(given)
    if not held.any():
        return regress(design.matrix, values, variance)
    fixed = np.concatenate([e.amplitudes() for e in effects])
    rest = regress(design.matrix[:, ~held], values - design.matrix[:, held] @ fixed[held], variance)
    covariance = np.zeros((held.size, held.size))
    covariance[np.ix_(~held, ~held)] = rest.covariance
    amplitudes = np.where(held, fixed, 0.0)
    amplitudes[~held] = rest.amplitudes
    return replace(rest, amplitudes=amplitudes, covariance=covariance)

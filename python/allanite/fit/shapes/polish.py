"""Joint optimization of coefficients, shapes and discrepancy from start values.

Each step solves a linear least-squares problem with the effective degrees of freedom: coefficients are non-negative, and
changes of shapes stay within a trust region. The step is shortened until the likelihood rises (Levenberg 1944; non-negative
least squares: Lawson & Hanson 1974).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.effects import Model, Stochastic
from allanite.fit.likelihood.discrepancy import likelihood, linearized, marginal_likelihood
from allanite.fit.likelihood.expected import column_of, columns
from allanite.fit.likelihood.peaks import is_fitted_to_ordinates

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.random_part import Linear, RandomPart
    from allanite.fit.likelihood.whittle import Maximum

#: Initial trust radius of a shape: in ln for positive shapes, in its unit for signed ones. Chosen by judgment; not
#: measured.
INITIAL_TRUST = 0.5
#: Trust radius below which the optimization ends. Chosen by judgment; not measured.
MIN_TRUST = 1e-5
#: Minimum distance of the logarithm of a shape from its limits, so that rounding cannot exceed a limit.
LIMIT_MARGIN = 1e-12
#: Maximum number of steps. Chosen by judgment; not measured.
MAX_STEPS = 60
#: Minimum rise of logL in a step; smaller rises end the optimization. Chosen by judgment; not measured.
MIN_STEP_DELTA_LOGL = 1e-4
#: Fraction of the minimum rise. The optimization ends, without another step, if the linearized model promises less.
#: Basis: ablation with benches/decisions/small_set.py. With 0.1, all models are those of searches without this rule; with
#: 1, one of the first 26 differs.
MAX_NEGLIGIBLE_PROMISE = 0.1
#: Maximum number of steps for candidates, which are only compared. Chosen by judgment; not measured.
MAX_ROUGH_STEPS = 15
#: Minimum rise of logL in a step for candidates. Chosen by judgment; not measured.
MIN_ROUGH_STEP_DELTA_LOGL = 0.03


@dataclass(frozen=True, slots=True)
class Shapes:
    """Free shapes of a model as coordinates of an optimization: logarithms of positive shapes, signed shapes unchanged.

    `places` are (index of the effect, name) of each shape; `signed` is True for shapes that may be negative. `limits`,
    shape (shapes, 2), are the lowest and highest value of each coordinate.
    """

    model: Model
    places: tuple[tuple[int, str], ...]
    signed: tuple[bool, ...]
    limits: Array

    @classmethod
    def of(cls, model: Model, places: list[tuple[int, str]], data: Data) -> Shapes:
        """`Shapes` of the shapes at `places`, pairs (index of the effect, name), with their limits."""
        signed, limits = [], []
        for place, name in places:
            effect = model.effects[place]
            declared = effect.parameter(name)
            low, high = (
                effect.checked_limits.clipped(name, e) for e in (declared.low, declared.high)
            )
            signed.append(declared.low < 0.0)
            if declared.low < 0.0:
                limits.append((low, high))
                continue
            least, most = effect.search_ends(name, data.n, data.rate)
            low = max(low, least, 1e-300)
            # exp(ln x) may differ from x by rounding; keep it within the limits.
            ends = np.log(low), np.log(max(low, min(high, most)))
            limits.append(
                (ends[0] + LIMIT_MARGIN, max(ends[0] + LIMIT_MARGIN, ends[1] - LIMIT_MARGIN))
            )
        return cls(model, tuple(places), tuple(signed), np.array(limits).reshape(-1, 2))

    def present(self) -> Array:
        """Coordinates of the model's present shapes, shape (shapes,)."""
        values = [self.model.effects[p].values[n] for p, n in self.places]
        at = [v if s else np.log(v) for v, s in zip(values, self.signed, strict=True)]
        return np.array(at, dtype=float)

    def start(self) -> Array:
        """Array of the coordinates of the model's present shapes, clipped to their limits, shape (shapes,)."""
        return np.clip(self.present(), self.limits[:, 0], self.limits[:, 1])

    def at(self, point: Array) -> Model:
        """Copy of the model with the shapes at the coordinates `point`."""
        moved: dict[int, dict[str, float]] = {}
        for (place, name), signed, at in zip(self.places, self.signed, point.tolist(), strict=True):
            moved.setdefault(place, {})[name] = at if signed else float(np.exp(at))
        model = self.model
        for place, values in moved.items():
            model = model.replaced(place, **values)
        return model

    def slopes(self, point: Array, now: Array, theta: Array, data: Data) -> Array:
        """Derivative of the expected bin power by each coordinate, shape (bins, shapes).

        `now` is the power of the model at the coordinates `point`, and `theta` its squared coefficients.
        """
        slopes = np.empty((now.size, point.size))
        before = self.at(point)
        for i, (place, _) in enumerate(self.places):
            moved = point.copy()
            h = 1e-4 if point[i] + 1e-4 < self.limits[i, 1] else -1e-4
            moved[i] += h
            after = self.at(moved)
            process = after.effects[place]
            # A process changes its own power alone, a modifier also that of others.
            if isinstance(process, Stochastic):
                own = sum(isinstance(e, Stochastic) for e in after.effects[:place])
                risen = column_of(after, process, data)
                risen = risen - column_of(before, before.stochastic[own], data)
                slopes[:, i] = risen * (theta[own] / h)
            else:
                slopes[:, i] = (columns(after, data) @ theta - now) / h
        return slopes


def polish(
    model: Model,
    places: list[tuple[int, str]],
    best: Maximum,
    part: RandomPart,
    *,
    roughly: bool = False,
) -> tuple[Model, Maximum]:
    """Pair: model with locally optimized shapes, and its `Maximum`.

    `places` lists the shapes as (index of the effect, name). Shapes of bands that are fitted to single ordinates are
    skipped. The optimization starts from `best`, the maximum of `model`, and makes at most 60 steps, or 15 with `roughly`.
    """
    places = [p for p in places if not is_fitted_to_ordinates(model.effects[p[0]], part.data)]
    if not places:
        return model, best
    shapes = Shapes.of(model, places, part.data)
    point, found = _climb(shapes, shapes.start(), best, part, roughly)
    model = shapes.at(point)
    # At other shapes, the discrepancy may vanish or appear.
    return model, part.maximize(model, found)


def _climb(
    shapes: Shapes, point: Array, best: Maximum, part: RandomPart, roughly: bool
) -> tuple[Array, Maximum]:
    """Pair: coordinates of the shapes at a local maximum of logL, and `best` with the coefficients and discrepancy there.

    The ascent starts at `point` and `best`. In the returned `best`, only `theta` and `scale` are new. The ascent ends

    * after 60 steps,
    * after a step below 0.1 of the trust radii that raises logL by less than 1e-4,
    * if the next step promises less than a tenth of this rise,
    * if no step raises logL until the trust radii are below 1e-5.

    With `roughly`, it ends after 15 steps, or after a step of any length that raises logL by less than 0.03.
    """
    power, count = part.power, part.count
    linear = part.linear(shapes.at(point))
    theta, scale = best.theta, best.scale
    floor = 1e-24 * float(power.max()) + 1e-300
    spectrum = np.maximum(linear.matrix @ theta, floor)
    value, weight = marginal_likelihood(power, count, spectrum, scale)
    trust = np.full(point.size, INITIAL_TRUST)
    steps, enough = (
        (MAX_ROUGH_STEPS, MIN_ROUGH_STEP_DELTA_LOGL)
        if roughly
        else (MAX_STEPS, MIN_STEP_DELTA_LOGL)
    )
    slopes: Array | None = None
    for _ in range(steps):
        if slopes is None:
            slopes = shapes.slopes(point, linear.matrix @ theta, theta, part.data)
        goal_theta, goal, promised = _step(
            slopes, point, trust, linear, theta, spectrum, weight, part
        )
        if promised < MAX_NEGLIGIBLE_PROMISE * enough:
            break
        risen, step = -1.0, 1.0
        while step > 0.02:
            tried = np.clip(point + step * (goal - point), shapes.limits[:, 0], shapes.limits[:, 1])
            moved_theta = theta + step * (goal_theta - theta)
            moved_linear = part.linear(shapes.at(tried))
            moved = np.maximum(moved_linear.matrix @ moved_theta, floor)
            found = marginal_likelihood(power, count, moved, scale)
            risen = found[0] - value
            if risen > 0.0:
                break
            step *= 0.4
        if risen <= 0.0:
            trust *= 0.2
            if trust.max() < MIN_TRUST:
                break
            continue
        slopes = None
        short = float(np.max(np.abs(tried - point) / trust)) < 0.1
        point, linear, theta = tried, moved_linear, moved_theta
        spectrum, (value, weight) = moved, found
        trust = np.minimum(trust * (1.6 if step == 1.0 else max(step, 0.3)), 1.5)
        before = value
        if scale is not None:
            scale, value, weight = likelihood(count).best_scale(power, spectrum, scale)
        if risen + value - before < enough and (short or roughly):
            break
    return point, replace(best, theta=theta, scale=scale)


def _step(
    slopes: Array,
    point: Array,
    trust: Array,
    linear: Linear,
    theta: Array,
    spectrum: Array,
    weight: Array,
    part: RandomPart,
) -> tuple[Array, Array, float]:
    """Tuple (squared coefficients θ, shape coordinates, rise of logL) at the optimum of a linearized model near `point`.

    Near the current shapes, the spectrum is linear in θ and in changes of the shapes, with the derivatives `slopes`, shape
    (bins, shapes). Nonnegative least squares finds both. A shape changes by at most `trust`. `linear` is the spectrum as a
    function of θ at the current shapes.
    """
    from scipy.optimize import nnls

    free = linear.matrix[:, linear.free]
    # Mean of absolute values: rounding can make parts of a column negative.
    units = 1.0 / np.maximum(np.mean(np.abs(free) / spectrum[:, None], axis=0), 1e-300)
    # A change u of a shape is −trust + v with v ≥ 0.
    scaled = np.hstack([free * units, slopes * trust]) / spectrum[:, None]
    matrix, target = linearized(scaled, part.power, part.count, spectrum, weight)
    start = np.concatenate([theta[linear.free] / units, np.ones(point.size)])
    before = float(target @ target)
    target = target + matrix @ start
    size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    # Nonnegative least squares has no upper limits. Shapes beyond theirs, v = 2, are fixed there and the others are solved
    # again, so that the coefficients fit the shapes of the step.
    solution = np.full(start.size, 2.0)
    solved = np.ones(start.size, dtype=bool)
    while solved.any():
        left = target - matrix[:, ~solved] @ solution[~solved]
        solution[solved] = nnls(matrix[:, solved] / size[solved], left)[0] / size[solved]
        beyond = solved & (np.arange(start.size) >= free.shape[1]) & (solution > 2.0)
        if not beyond.any():
            break
        solution[beyond] = 2.0
        solved &= ~beyond
    out = linear.fixed.copy()
    out[linear.free] = solution[: free.shape[1]] * units
    change = np.where(np.abs(slopes).max(axis=0) > 0.0, solution[free.shape[1] :] - 1.0, 0.0)
    left = target - matrix @ solution
    return out, point + change * trust, 0.25 * (before - float(left @ left))

"""Fit shape parameters (time constants, frequencies): grid search without a start value, then joint optimization."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import CATALOG, Deterministic, Effect, Model, Stochastic
from allanite.fit.models import with_effect, without_effect
from allanite.fit.shapes.deterministic import (
    LOWEST_ORDINATES,
    comb_gains,
    comb_window,
    delta_logl_of,
    design_of,
    ordinates_near,
    ordinates_of_line,
    regress,
    residual_ordinates_at,
)
from allanite.fit.shapes.drifting import loudest_frequency, polished_line
from allanite.fit.shapes.matched import (
    basis_of,
    best_spans,
    grid_points,
    matched_gains,
    orthogonal_to,
    regressor_ordinates,
)
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import (
    better_form,
    free_shape_parameters,
    polished_designs,
    simplest_design,
)
from allanite.fit.shapes.simplex import MIN_SHAPE_DELTA_LOGL
from allanite.fit.shapes.tones import polish_burst

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise
    from allanite.fit.likelihood.random_part import Linear, RandomPart
    from allanite.fit.likelihood.whittle import Maximum

#: Number of ordinates to each side of a line that are used to optimize its frequency. Chosen by judgment; not measured.
ORDINATES_BESIDE_LINE = 48
#: Maximum number of lines of a comb that are used to optimize its frequency. Chosen by judgment; not measured.
MAX_OPTIMIZED_LINES = 12
#: Number of lines of a comb above which each line is evaluated separately, if they do not overlap.
#: Chosen by judgment; not measured.
MAX_JOINT_LINES = 3
#: Maximum number of parabolas through three ΔlogL whose vertices lead to the frequency of a line.
#: Chosen by judgment; not measured.
MAX_PARABOLAS = 20
#: Tolerance of a shape of a slow function, as a fraction of the distance between its neighbors on the grid.
#: Chosen by judgment; not measured.
SHAPE_TOLERANCE = 1e-3
#: Maximum number of pieces of an effect of free form. Chosen by judgment; not measured.
MAX_PIECES = 6
#: Number of least significant pieces whose removal is tried in each round. Chosen by judgment; not measured.
MAX_TRIED_REMOVALS = 4


def fit_shapes(
    model: Model, part: RandomPart, start: Maximum | None = None, *, polished: bool = True
) -> tuple[Model, Maximum]:
    """Pair: model whose shapes of random effects and modifiers maximize logL, and the `Maximum` there.

    Shapes without a value are searched on grids, one effect after the other. If several effects have such shapes, this is
    done twice. Effects that are sums of simple processes get their processes (`built_from_pieces`). At last all free shapes
    are optimized together. `start` is a maximum of this model over its coefficients. Without `polished`, searched shapes
    stay at points of their grids, and the others are unchanged.
    """
    blank = model.effects
    opened = [
        i for i, e in enumerate(blank) if not isinstance(e, Deterministic) and _has_open_shape(e)
    ]
    # Open shapes of later effects start in the middle of their grids; a second pass runs when all have values.
    for place in opened * (2 if len(opened) > 1 else 1):
        points = grid_points(blank[place], part.data.n, part.data.rate)
        points += _suggested_by_ordinates(blank[place], part)
        models = [_with_grid_middles(with_effect(model, place, p), part.data) for p in points]
        tried = [(part.maximize(m), m) for m in models]
        tried.sort(key=lambda pair: -pair[0].log_likelihood)
        start, chosen = tried[0]
        if polished:
            chosen, start = simplest_design(polished_designs(tried, place, part), place)
            chosen, start = better_form(chosen, place, start, part)
        model = with_effect(model, place, chosen.effects[place])
    for place in indices_of_unbuilt(model, part):
        model, start = built_from_pieces(model, place, part), None
    found = part.maximize(model, start)
    return polish(model, free_shape_parameters(model), found, part) if polished else (model, found)


def _suggested_by_ordinates(effect: Effect, part: RandomPart) -> list[Effect]:
    """List of effects of the same kind, with values, that single ordinates suggest, e.g. at a peak.

    They agree with the values that `effect` already has. Empty for an expected spectrum and for a summary, which have no
    single ordinates.
    """
    data = part.data
    if part.is_expected or not data.whole:
        return []
    given = {k: v for k, v in effect.values.items() if v is not None}
    seen = type(effect).seen_in(data.ordinates**2, data.rate)
    return [e for e in seen if all(e.values[name] == value for name, value in given.items())]


def with_open_shapes(model: Model, given: Model) -> Model:
    """Copy of the model in which random effects and modifiers with an unknown shape in `given` are again as in `given`."""
    return Model(
        tuple(
            old if not isinstance(old, Deterministic) and _has_open_shape(old) else new
            for new, old in zip(model.effects, given.effects, strict=True)
        )
    )


def _has_open_shape(effect: Effect) -> bool:
    """True if a shape, or a choice among several variants, of an effect has no value."""
    undecided = len(effect.variants()) > 1 and any(
        p.role == "choice" and effect.values[p.name] is None for p in effect.parameters
    )
    return undecided or any(effect.values[n] is None for n in effect.free_shapes)


def _with_grid_middles(model: Model, data: Data) -> Model:
    """Copy of the model in which random effects and modifiers with unknown shapes have those of the middle grid point."""
    for place, effect in enumerate(model.effects):
        if not isinstance(effect, Deterministic) and _has_open_shape(effect):
            points = grid_points(effect, data.n, data.rate)
            model = with_effect(model, place, points[len(points) // 2])
    return model


def fit_deterministic_shapes(
    model: Model,
    noise: Noise,
    data: Data,
    *,
    polished: bool,
    settled: int = 0,
    kept: Collection[Effect] = (),
) -> Model:
    """Copy of the model with optimized shapes of its deterministic effects, for a given spectrum of the noise.

    Shapes without a value are always searched, the others only if `polished`. The last effect of the model, which a search
    just added, is always optimized unless it is a slow function. The first `settled` effects are unchanged if all their
    shapes have values. Lines with the same shapes as an effect in `kept` are unchanged.
    """
    alike = {effect.seen_alike for effect in kept if isinstance(effect, Deterministic)}
    for place, effect in enumerate(model.effects):
        if not isinstance(effect, Deterministic) or not effect.free_shapes:
            continue
        if effect.periodic and effect.seen_alike in alike:
            continue
        if all(effect.values[n] is not None for n in effect.free_shapes):
            is_added = place == len(model.effects) - 1 and not effect.low
            if place < settled or not (polished or is_added):
                continue
        others = tuple(
            e for i, e in enumerate(model.effects) if i != place and isinstance(e, Deterministic)
        )
        if effect.periodic:
            effect = _optimized_line(effect, others, noise, data)
        elif effect.low:
            effect = _optimized_slow(effect, others, noise, data)
        else:
            left = data.ordinates_without(_with_values(others))
            if effect.interval:
                effect = polish_burst(effect, left, noise, data)
            else:
                effect, _ = polished_line(effect, left, noise, data)
        model = with_effect(model, place, effect)
    return model


def _optimized_line(
    effect: Deterministic, others: tuple[Deterministic, ...], noise: Noise, data: Data
) -> Deterministic:
    """Copy of a line, or of a line with harmonics, with its most likely frequency.

    A line without a frequency also gets an amplitude, so that the search of the next line starts from the residual.
    """
    known, start = _with_values(others), effect.base_frequency
    if start is None:
        start = loudest_frequency(effect, data.ordinates_without(known), noise, data)
    multiples = optimized_multiples(effect)
    j = comb_window(start, multiples, data, ORDINATES_BESIDE_LINE)
    left = residual_ordinates_at(known, j, data)
    # The frequency of a fitted line is known as well as that of its highest harmonic.
    is_fitted = any(v is not None and v != 0.0 for v in effect.amplitudes())
    error = 2.0 / max(multiples) if is_fitted else 2.0
    found = polish_line(start, j, left, noise, data, multiples, error)
    found = effect.checked_limits.clipped("frequency", found)
    placed = effect.with_values(frequency=found)
    if effect.values["frequency"] is not None or effect.held:
        return placed
    design = design_of((placed,), data)
    left = residual_ordinates_at(known, design.ordinates, data)
    variance = noise.variance(design.ordinates)
    return placed.with_amplitudes(regress(design.matrix, left, variance).amplitudes)


def _with_values(effects: tuple[Deterministic, ...]) -> list[Deterministic]:
    """List of those effects that have values of all free shapes and an amplitude other than 0."""
    known = [e for e in effects if any(v is not None and v != 0.0 for v in e.amplitudes())]
    return [e for e in known if all(e.values[n] is not None for n in e.free_shapes)]


def optimized_multiples(effect: Deterministic) -> list[float]:
    """List of the multiples of a line's frequency that determine it: all, or 12 from the lowest to the highest."""
    multiples = [m for m, _, _ in effect.lines]
    if len(multiples) <= MAX_OPTIMIZED_LINES:
        return multiples
    few = np.linspace(0, len(multiples) - 1, MAX_OPTIMIZED_LINES).astype(int)
    return [multiples[i] for i in few]


def polish_line(
    start: float,
    j: NDArray[np.int64],
    values: Array,
    noise: Noise,
    data: Data,
    multiples: Sequence[float] = (1,),
    error: float = 2.0,
) -> float:
    """Frequency near `start`, Hz, at which a line with its harmonics has the largest ΔlogL.

    The lines are fitted to the ordinates `values` with the indices j. The result differs from `start` by at most about
    `error` ordinates, that is `error`/2T with the duration T of the record. `start` is returned if ΔlogL rises by less than
    1e-3.
    """
    variance = noise.variance(j)
    step = data.rate / (2.0 * data.n)
    windows = [
        np.isin(j, ordinates_near(m * start, data, ORDINATES_BESIDE_LINE), assume_unique=True)
        for m in multiples
    ]

    def gains_apart(tried: Array) -> Array:
        """ΔlogL at each base frequency in `tried` (Hz), summed over the line and its harmonics, each fitted alone."""
        total = np.zeros(tried.size)
        for m, own in zip(multiples, windows, strict=True):
            total += comb_gains(tried, [m], j[own], values[own], variance[own], data)
        return total

    # Together the lines cost the square of their number. Lines that do not overlap are the same apart.
    is_apart = len(multiples) > MAX_JOINT_LINES and start > (2 * ORDINATES_BESIDE_LINE + 2) * step

    def gains(tried: Array) -> Array:
        """ΔlogL at each base frequency in `tried`, Hz."""
        if is_apart:
            return gains_apart(tried)
        return comb_gains(tried, multiples, j, values, variance, data)

    # The highest harmonic determines the step. The grid only selects the maximum, for which lines may be taken apart.
    fine = step / (8.0 * max(multiples))
    grid = start + np.arange(-error * step, error * step + 2.0 * fine, 4.0 * fine)
    highest = (data.rate / 2.0 - step) / max(multiples)
    inside = (grid > step) & (grid < highest)
    tried = np.append(grid[inside], start)
    center = float(tried[int(np.argmax(gains_apart(tried)))])
    around = fine * np.array([-1.0, 0.0, 1.0])
    if center == start and _is_at_maximum(*gains_apart(start + around)):
        return start
    for _ in range(MAX_PARABOLAS):
        before, here, after = gains(center + around)
        curvature = before + after - 2.0 * here
        vertex = 0.5 * (before - after) / curvature if curvature < 0.0 else np.sign(after - before)
        center += fine * float(np.clip(vertex, -2.0, 2.0))
        if _is_at_maximum(before, here, after):
            break
    # A line below the first ordinate has a mirror image at its negative frequency.
    if not step < center < highest:
        return start
    rise = np.diff(gains(np.array([start, center])))[0]
    return center if rise > MIN_SHAPE_DELTA_LOGL else start


def _is_at_maximum(before: float, here: float, after: float) -> bool:
    """True if the maximum of the parabola through three logL, at equal distances, is less than 1e-3 above `here`."""
    curvature = before + after - 2.0 * here
    return curvature < 0.0 and (after - before) ** 2 < -8.0 * curvature * MIN_SHAPE_DELTA_LOGL


def _with_best_times(
    effect: Deterministic, others: tuple[Deterministic, ...], noise: Noise, data: Data
) -> Deterministic:
    """Copy of the effect with the most likely pair of times, if two of its times are unknown; otherwise the effect itself.

    A grid of all pairs would not fit into memory.
    """
    unknown = [name for name in effect.free_shapes if effect.values[name] is None]
    if len(unknown) < 2:
        return effect
    known = _with_values(others)
    for cls in CATALOG:
        if issubclass(cls, Deterministic):
            for found, _ in best_spans(cls, data.ordinates_without(known), noise, data, known):
                if type(found) is type(effect):
                    values = {name: float(found.values[name]) for name in unknown}
                    return effect.with_values(
                        **{
                            name: effect.checked_limits.clipped(name, v)
                            for name, v in values.items()
                        }
                    )
    return effect


def _optimized_slow(
    effect: Deterministic, others: tuple[Deterministic, ...], noise: Noise, data: Data
) -> Deterministic:
    """Copy of a slow function of time whose shapes (times and time constants) are optimized, one after the other.

    The amplitudes of the other deterministic effects are fitted for each value. A shape keeps its value if logL rises by
    less than 1e-3. If its grid starts at 0, it becomes 0 unless this lowers logL by more than 1e-3.
    """
    j = np.arange(1, min(data.n, LOWEST_ORDINATES), dtype=np.int64)
    beside = tuple(e for e in others if e.low or ordinates_of_line(e, data)[0] <= j[-1])
    design = design_of(beside, data, j) if beside else None
    root = 1.0 / np.sqrt(noise.variance(j))
    target, basis = data.ordinates[j] * root, np.zeros((j.size, 0))
    if design is not None:
        basis = basis_of(design.matrix.T * root)
        target -= basis @ (basis.T @ target)

    effect = _with_best_times(effect, others, noise, data)
    names = effect.free_shapes
    if any(effect.values[name] is None for name in names):
        points, known_others = grid_points(effect, data.n, data.rate), _with_values(others)
        left = data.ordinates_without(known_others)
        gains, _ = matched_gains(points, left, noise, data, known_others)
        effect = points[int(np.argmax(gains))]
    for name in names:
        grid = np.unique(effect.searched(name, data.n, data.rate))

        def loss(value: float, name: str = name, base: Deterministic = effect) -> float:
            """Negative ΔlogL of the effect `base` if its shape `name` has this value."""
            tried = base.with_values(**{name: value})
            rows = orthogonal_to(basis, regressor_ordinates([tried], j, data) * root)
            return -delta_logl_of(rows, target)

        known = _minimum_on_grid(loss, effect.values[name], grid)
        # A shape whose grid starts at 0, such as a time constant, is set to 0 if that does not lower logL.
        if grid[0] == 0.0 < known and loss(0.0) <= loss(known) + MIN_SHAPE_DELTA_LOGL:
            known = 0.0
        effect = effect.with_values(**{name: known})
    return effect


def _minimum_on_grid(loss: Callable[[float], float], start: float, grid: Array) -> float:
    """Place of the minimum of `loss` near `start`, within the ascending `grid`; `start` if it is lower by less than 1e-3.

    A search lies between the neighbors of the nearest grid point. While it ends at one of them, the next reaches twice as
    many grid points to each side.
    """
    from scipy.optimize import minimize_scalar

    known, reach = start, 1
    while True:
        at = int(np.argmin(np.abs(grid - known)))
        low, high = float(grid[max(0, at - reach)]), float(grid[min(grid.size - 1, at + reach)])
        step = SHAPE_TOLERANCE * (high - low)
        is_inside = low < known - step and known + step < high
        if low == high or (
            is_inside and _is_at_maximum(*(-loss(known + s * step) for s in (-1, 0, 1)))
        ):
            return known
        found = minimize_scalar(
            loss, bounds=(low, high), method="bounded", options={"maxiter": 20, "xatol": step}
        )
        if not found.fun < loss(known) - MIN_SHAPE_DELTA_LOGL:
            return known
        known = float(found.x)
        is_between = low + 2.0 * step < known < high - 2.0 * step
        if is_between and reach == 1:
            return known
        reach = 1 if is_between else 2 * reach


def indices_of_unbuilt(model: Model, part: RandomPart) -> list[int]:
    """Indices of the effects that are sums of simple processes (`Stochastic.pieces`), which have not yet been chosen."""
    return [
        place
        for place, effect in enumerate(model.effects)
        if isinstance(effect, Stochastic)
        and type(effect).pieces(part.data.n, part.data.rate)
        and all(effect.values[p.name] is None for p in effect.parameters if p.role == "choice")
    ]


def built_from_pieces(model: Model, place: int, part: RandomPart) -> Model:
    """Copy of the model in which the effect at index `place` becomes the sum of up to six chosen simple processes.

    All simple processes (`pieces`) are first fitted at once, together with the other effects. Processes of zero power and
    the least useful ones are then removed one by one. This ends at six or fewer, when the next removal would lose more logL
    than 2 (two parameters, Akaike 1974) plus ln of the number of pieces. If none is left, or if the model has no other
    noise process, the middle piece is used.
    """
    effect = model.effects[place]
    assert isinstance(effect, Stochastic)
    pieces = type(effect).pieces(part.data.n, part.data.rate)
    others = without_effect(model, place)
    middle = [pieces[len(pieces) // 2]]
    chosen, variances = middle, np.ones(1)
    if others.stochastic:
        linear = part.linear(Model((*others.effects, *pieces)))
        first = linear.matrix.shape[1] - len(pieces)
        found = part.maximize(Model((*others.effects, *pieces)))
        kept, price = np.arange(len(pieces)), 2.0 + np.log(len(pieces))
        while kept.size:
            theta = found.theta[first:]
            tried = (
                _least_significant(linear, first, found, part)
                if (theta > 0.0).all()
                else [int(theta.argmin())]
            )
            ends = {
                i: part.climb(
                    linear.without(first + i), np.delete(found.theta, first + i), found.scale
                )
                for i in tried
            }
            least = max(ends, key=lambda i: ends[i].log_likelihood)
            lost = found.log_likelihood - ends[least].log_likelihood
            if (theta > 0.0).all() and kept.size <= MAX_PIECES and lost > price:
                break
            found = ends[least]
            linear = linear.without(first + least)
            kept = np.delete(kept, least)
        if kept.size:
            chosen, variances = [pieces[i] for i in kept], found.theta[first:]
    made = type(effect).joined(chosen, [float(v) for v in variances])
    held = {name: effect.values[name] for name in effect.held}
    made = made.with_values(
        **held, hold=effect.hold, limits=effect.limits, at_limit=effect.at_limit
    )
    return with_effect(model, place, made)


def _least_significant(linear: Linear, first: int, found: Maximum, part: RandomPart) -> list[int]:
    """List of the indices, from the column `first` on, of at most four least significant processes, the least first.

    The significance is the squared coefficient over its standard error (inverse Fisher information).
    """
    theta = found.theta
    share = linear.matrix * (np.sqrt(0.5 * part.count) / (linear.matrix @ theta))[:, None]
    variance = np.diag(np.linalg.pinv(share.T @ share, hermitian=True))[first:]
    known = theta[first:] ** 2 / np.maximum(variance, 1e-300)
    return [int(i) for i in np.argsort(known)[:MAX_TRIED_REMOVALS]]

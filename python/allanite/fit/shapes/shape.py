"""Fit shape parameters (time constants, frequencies): grid search without a start value, then joint optimization."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import CATALOGUE, Deterministic, Effect, Model
from allanite.fit.models import with_effect
from allanite.fit.shapes.deterministic import (
    LOWEST_ORDINATES,
    comb_gains,
    comb_ordinates,
    comb_window,
    design_of,
    ordinates_near,
    regress,
    residual_ordinates_at,
)
from allanite.fit.shapes.drifting import MIN_SHAPE_DELTA_LOGL, loudest_frequency, polish_drifting
from allanite.fit.shapes.joined import built_from_pieces, indices_of_unbuilt
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
from allanite.fit.shapes.tones import polish_burst

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise
    from allanite.fit.likelihood.random_part import RandomPart
    from allanite.fit.likelihood.whittle import Maximum

#: Number of ordinates to each side of a line that are used to optimize its frequency. Chosen by judgment; not measured.
ORDINATES_BESIDE_LINE = 48
#: Maximum number of lines of a comb that are used to optimize its frequency. Chosen by judgment; not measured.
MAX_OPTIMIZED_LINES = 12
#: Number of lines of a comb above which each line is evaluated separately, if they do not overlap.
#: Chosen by judgment; not measured.
MAX_JOINT_LINES = 3
#: Tolerance of a shape of a slow function, as a fraction of the distance between its neighbors on the grid.
#: Chosen by judgment; not measured.
SHAPE_TOLERANCE = 1e-3
#: Distance of the points, in tolerances, at which a shape that has a value is tested for the minimum. With half and
#: twice the distance, 12 of 12 searches of events keep effects and logL (benches/decisions/chosen_values.py steps).
STEP_TOLERANCES = 4.0


def grid_models(model: Model, place: int, data: Data) -> list[Model]:
    """List of copies of the model, one for each grid point of the unknown shapes of the effect at index `place`.

    If the effect has several variants (e.g. orders), the points of all variants are included. Shapes that have a value
    are then put on the grid, too.
    """
    variants = model.effects[place].variants()
    out = []
    for start in variants:
        values = start.values
        names = [n for n in start.free_shapes if values[n] is None]
        if len(variants) > 1:
            names = [n for n in start.free_shapes if not isinstance(values[n], str)]
        grids = [start.searched(n, data.n, data.rate) for n in names]
        chosen = {p.name: values[p.name] for p in start.parameters if p.role == "choice"}
        out += [
            model.replaced(place, **chosen, **dict(zip(names, map(float, point), strict=True)))
            for point in product(*grids)
        ]
    return out


def fit_shapes(
    model: Model, part: RandomPart, start: Maximum | None = None, *, polished: bool = True
) -> tuple[Model, Maximum]:
    """Pair: model whose shapes of random effects and modifiers maximize logL, and the `Maximum` there.

    Shapes without a value are searched on grids, one effect after the other. If several effects have such shapes, this
    is done twice. Effects that are sums of simple processes get their processes (`built_from_pieces`). At last all free
    shapes are optimized together. `start` is a maximum of this model over its coefficients, or None. With `polished`
    False, searched shapes stay at points of their grids, and the others are unchanged.
    """
    blank = model.effects
    opened = [
        i for i, e in enumerate(blank) if not isinstance(e, Deterministic) and _has_open_shape(e)
    ]
    # Open shapes of later effects start in the middle of their grids; a second pass runs when all have values.
    for place in opened * (2 if len(opened) > 1 else 1):
        points = grid_models(with_effect(model, place, blank[place]), place, part.data)
        points += [
            with_effect(model, place, e) for e in _suggested_by_ordinates(blank[place], part)
        ]
        tried = [(part.maximize(m), m) for m in (_with_grid_middles(p, part.data) for p in points)]
        tried.sort(key=lambda pair: -pair[0].log_likelihood)
        ends = [(m, found) for found, m in tried[:1]]
        if polished:
            ends += polished_designs(tried, place, part)
        chosen, start = simplest_design(ends, place)
        if polished:
            chosen, start = better_form(chosen, place, start, part)
        model = with_effect(model, place, chosen.effects[place])
    for place in indices_of_unbuilt(model, part):
        model, start = built_from_pieces(model, place, part), None
    found = part.maximize(model, start)
    return polish(model, free_shape_parameters(model), found, part) if polished else (model, found)


def _suggested_by_ordinates(effect: Effect, part: RandomPart) -> list[Effect]:
    """List of effects of the same kind, with values, that single ordinates suggest, e.g. at a peak.

    They agree with the values that `effect` already has. The list is empty for an expected spectrum, and for a record of
    which only a summary is kept: both have no single ordinates.
    """
    data = part.data
    if part.is_expected or not data.whole:
        return []
    given = {k: v for k, v in effect.values.items() if v is not None}
    seen = type(effect).seen_in(data.ordinates**2, data.rate)
    return [e for e in seen if all(e.values[name] == value for name, value in given.items())]


def with_open_shapes(model: Model, given: Model) -> Model | None:
    """Copy of the model in which random effects and modifiers with an unknown shape in `given` are again as in `given`.

    All other effects, e.g. functions of time, keep their values. None if this changes nothing.
    """
    effects = [
        old if not isinstance(old, Deterministic) and _has_open_shape(old) else new
        for new, old in zip(model.effects, given.effects, strict=True)
    ]
    return Model(tuple(effects)) if tuple(effects) != model.effects else None


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
            points = grid_models(model, place, data)
            model = points[len(points) // 2]
    return model


def fit_deterministic_shapes(
    model: Model, noise: Noise, data: Data, *, lines: bool, slow: bool, settled: int = 0
) -> Model:
    """Copy of the model with optimized shapes of its deterministic effects, for a given spectrum of the noise.

    Shapes without a value are always searched. With `lines`, the frequencies of lines are optimized; with `slow`, the
    shapes of slow functions, drifting lines and bursts. The last effect of the model, which a search just added, is always
    optimized unless it is a slow function. The first `settled` effects are unchanged if all their shapes have values.
    """
    for place, effect in enumerate(model.effects):
        if not isinstance(effect, Deterministic) or not effect.free_shapes:
            continue
        if place < settled and all(effect.values[n] is not None for n in effect.free_shapes):
            continue
        others = tuple(
            e for i, e in enumerate(model.effects) if i != place and isinstance(e, Deterministic)
        )
        if effect.periodic:
            start = effect.base_frequency
            if start is not None and not lines and place < len(model.effects) - 1:
                continue
            valued_others = _with_values(others)
            if start is None:
                start = loudest_frequency(
                    effect, data.ordinates_without(valued_others), noise, data
                )
            multiples = [m for m, _, _ in effect.lines]
            j = comb_window(start, multiples, data, ORDINATES_BESIDE_LINE)
            left = residual_ordinates_at(valued_others, j, data)
            found = polish_line(start, j, left, noise, data, multiples)
            found = effect.checked_limits.clipped("frequency", found)
            model = model.replaced(place, frequency=found)
            if effect.values["frequency"] is None and not effect.held:
                # Give the line an amplitude, so that the search of the next line starts from the residual.
                j = comb_window(found, multiples, data)
                line = comb_ordinates(found, multiples, j, data)
                left = residual_ordinates_at(valued_others, j, data)
                size = regress(line, left, noise.variance(j)).amplitudes
                placed = effect.with_values(frequency=found).with_amplitudes(size)
                model = with_effect(model, place, placed)
        elif not effect.low:
            if slow or place == len(model.effects) - 1 or effect.values["frequency"] is None:
                left = data.ordinates_without(_with_values(others))
                polished = polish_burst if effect.interval else polish_drifting
                model = with_effect(model, place, polished(effect, left, noise, data))
        elif slow or any(effect.values[n] is None for n in effect.free_shapes):
            model = _optimize_slow(model, place, others, noise, data)
    return model


def _with_values(effects: tuple[Deterministic, ...]) -> list[Deterministic]:
    """List of those effects that have values of all free shapes and an amplitude other than 0."""
    known = [e for e in effects if any(v is not None and v != 0.0 for v in e.amplitudes())]
    return [e for e in known if all(e.values[n] is not None for n in e.free_shapes)]


def polish_line(
    start: float,
    j: NDArray[np.int64],
    values: Array,
    noise: Noise,
    data: Data,
    multiples: Sequence[float] = (1,),
) -> float:
    """Frequency near `start`, Hz, at which a line with its harmonics has the largest ΔlogL.

    The lines are fitted to the ordinates `values` with the indices j. The result differs from `start` by at most about 1/T,
    with the duration T of the record. `start` is returned if ΔlogL rises by less than 1e-3. If there are more than 12
    `multiples`, only 12 of them are used.
    """
    if len(multiples) > MAX_OPTIMIZED_LINES:
        # For a pulse train, a few of its lines determine the frequency.
        multiples = [
            multiples[i]
            for i in np.linspace(0, len(multiples) - 1, MAX_OPTIMIZED_LINES).astype(int)
        ]
        values = values[
            np.isin(j, near := comb_window(start, multiples, data, ORDINATES_BESIDE_LINE))
        ]
        j = near
    variance = noise.variance(j)
    step = data.rate / (2.0 * data.n)

    windows = [
        np.isin(j, ordinates_near(m * start, data, ORDINATES_BESIDE_LINE), assume_unique=True)
        for m in multiples
    ]

    def gains_apart(tried: Array) -> Array:
        """Array of the ΔlogL at each base frequency in `tried` (Hz), summed over the line and its harmonics.

        Each of these lines is fitted alone, to the ordinates near its frequency.
        """
        total = np.zeros(tried.size)
        for m, own in zip(multiples, windows, strict=True):
            total += comb_gains(tried, [m], j[own], values[own], variance[own], data)
        return total

    # Together the lines cost the square of their number. Lines that do not overlap are the same apart.
    is_apart = len(multiples) > MAX_JOINT_LINES and start > (2 * ORDINATES_BESIDE_LINE + 2) * step
    gains_together = partial(
        comb_gains, multiples=multiples, j=j, values=values, variance=variance, data=data
    )
    gains_at = gains_apart if is_apart else gains_together
    # The highest harmonic determines the step.
    fine = step / (8.0 * max(multiples))
    spacing = fine / 8.0
    here, center, best = _peak(start + spacing * np.arange(-1.0, 2.0), gains_at)
    if center == start:
        # Noise that was fitted again moves the maximum by a fraction of its width.
        _, center, best = _peak(start + spacing * np.arange(-8.0, 9.0), gains_at)
    if center == start:
        grid = start + np.arange(-2.0 * step, 2.0 * step + 0.5 * fine, fine)
        inside = (grid > step) & (grid * max(multiples) < data.rate / 2.0 - step)
        tried = np.append(grid[inside], start)
        # The grid only selects the maximum, for which lines that overlap may be taken apart.
        center = float(tried[int(np.argmax(gains_apart(tried)))])
        _, center, best = _peak(center + spacing * np.arange(-8.0, 9.0), gains_at)
    return start if best - here < MIN_SHAPE_DELTA_LOGL else center


def _peak(tried: Array, gains_at: Callable[[Array], Array]) -> tuple[float, float, float]:
    """Tuple (ΔlogL at the middle, frequency of the maximum, its ΔlogL) over the equally spaced frequencies `tried`, Hz.

    `gains_at` returns the ΔlogL at each frequency of an array. The maximum is that of a parabola through the best
    frequency and its neighbors. If the best frequency is at an end, the middle counts as the maximum.
    """
    gains = gains_at(tried)
    middle = tried.size // 2
    k = int(np.argmax(gains))
    if not 0 < k < tried.size - 1:
        return float(gains[middle]), float(tried[middle]), float(gains[middle])
    bend, slope = 2.0 * gains[k] - gains[k - 1] - gains[k + 1], 0.5 * (gains[k + 1] - gains[k - 1])
    shift = float(slope / bend) if bend > 0.0 else 0.0
    at = float(tried[k] + shift * (tried[1] - tried[0]))
    return float(gains[middle]), at, float(gains[k] + 0.5 * slope * shift)


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
    for cls in CATALOGUE:
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


def _is_at_minimum(loss: Callable[[float], float], at: float, step: float) -> bool:
    """True if a function `loss` has its minimum practically at `at`, by a parabola through three points `step` apart.

    The minimum of the parabola may be lower than loss(at) by at most `MIN_SHAPE_DELTA_LOGL`.
    """
    low, middle, high = (loss(at + side * step) for side in (-1.0, 0.0, 1.0))
    bend, slope = low + high - 2.0 * middle, 0.5 * (high - low)
    return abs(slope) <= bend and 0.5 * slope**2 < MIN_SHAPE_DELTA_LOGL * bend


def _optimize_slow(
    model: Model, place: int, others: tuple[Deterministic, ...], noise: Noise, data: Data
) -> Model:
    """Copy of the model in which the shapes of the slow effect at index `place` are optimized, one after the other.

    Shapes are times and time constants. The amplitudes of the other deterministic effects are fitted for each value. A
    shape keeps its value if logL rises by less than 1e-3. If its grid starts at 0, it becomes 0 unless this lowers logL by
    more than 1e-3.
    """
    from scipy.optimize import minimize_scalar

    effect = model.effects[place]
    assert isinstance(effect, Deterministic)
    j = np.arange(1, min(data.n, LOWEST_ORDINATES), dtype=np.int64)
    design = design_of(others, data) if others else None
    if design is not None:
        j = np.concatenate([j, design.ordinates[design.ordinates >= LOWEST_ORDINATES]])
        design = design if design.ordinates.size == j.size else design_of(others, data, j)
    root = 1.0 / np.sqrt(noise.variance(j))
    target, basis = data.ordinates[j] * root, np.zeros((j.size, 0))
    if design is not None:
        basis = basis_of(design.matrix.T * root)
        target -= basis @ (basis.T @ target)

    effect = _with_best_times(effect, others, noise, data)
    for name in effect.free_shapes:

        def loss(value: float, name: str = name, base: Deterministic = effect) -> float:
            """Negative ΔlogL of the effect `base` if its shape `name` has this value."""
            tried = base.with_values(**{name: value})
            rows = orthogonal_to(basis, regressor_ordinates([tried], j, data) * root)
            return -regress(rows.T, target, np.ones(j.size)).gain

        grid = np.unique(effect.searched(name, data.n, data.rate))
        known = effect.values[name]
        if known is None:
            points = grid_points(effect, data)
            gains, _ = matched_gains(
                points,
                data.ordinates_without(_with_values(others)),
                noise,
                data,
                _with_values(others),
            )
            known = float(points[int(np.argmax(gains))].values[name])
        at = int(np.searchsorted(grid, known))
        low, high = float(grid[max(0, at - 1)]), float(grid[min(grid.size - 1, at + 1)])
        step = STEP_TOLERANCES * SHAPE_TOLERANCE * (high - low)
        inside = low + step <= known <= high - step
        if high > low and not (inside and _is_at_minimum(loss, known, step)):
            found = minimize_scalar(
                loss,
                bounds=(low, high),
                method="bounded",
                options={"maxiter": 20, "xatol": SHAPE_TOLERANCE * (high - low)},
            )
            if found.fun < loss(known) - MIN_SHAPE_DELTA_LOGL:
                known = float(found.x)
        # A shape whose grid starts at 0, such as a time constant, is set to 0 if that does not lower logL.
        if grid[0] == 0.0 < known and loss(0.0) <= loss(known) + MIN_SHAPE_DELTA_LOGL:
            known = 0.0
        effect = effect.with_values(**{name: known})
    return model.replaced(place, **{n: effect.values[n] for n in effect.free_shapes})

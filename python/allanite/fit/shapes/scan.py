"""Add a random effect or filter to a model at every point of its shape grid, and find the likelihood maxima.

If a model lacks an effect, other effects imitate it, or the discrepancy discounts the bins where it acts. The start at
each grid point therefore keeps the model and adds the effect with the power that explains the excess in the bin where the
effect is strongest.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit.likelihood.expected import column_of
from allanite.fit.likelihood.whittle import Maximum, climb_many
from allanite.fit.models import with_effect
from allanite.fit.shapes.polish import polish
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.random_part import RandomPart


#: Minimum number of grid points whose shapes are optimized further. Chosen by judgment; not measured.
MIN_OPTIMIZED_POINTS = 2
#: Number of Fisher-scoring steps at every grid point, to select the best. Chosen by judgment; not measured.
SELECTION_STEPS = 3
#: Number of Fisher-scoring steps at the selected grid points, to rank them. Chosen by judgment; not measured.
RANKING_STEPS = 12
#: Fraction of the grid points that are selected, in addition to the best of every design. Chosen by judgment; not measured.
SELECTED_FRACTION = 0.2
#: Minimum number of ranked points that are finally optimized with all bins instead of cells.
#: Chosen by judgment; not measured.
MIN_RANKED_POINTS = 10
#: Maximum loss of logL for which a simpler design of an effect is preferred. Chosen by judgment; not measured.
MAX_SIMPLER_LOSS = 2.0


def scan_added_effect(
    model: Model, points: list[Effect], base: Maximum, part: RandomPart
) -> list[tuple[Maximum, Model]]:
    """List of (maximum, model): the model plus one of the best grid points of an effect, the highest logL first.

    `points` are copies of the effect with the shape values of each grid point. `base` is the maximum of the model without
    the effect. Of a band, the best fifth of the points is kept, of any other effect the best ten of this fifth. The best
    point of each design, i.e. of each set of choices, is kept, too. If a coefficient is held, all points are kept.
    """
    smooth = _smooth(part.power - base.spectrum, part.count)
    before = part.linear(model)
    held = (p.coefficient in p.held for p in points if isinstance(p, Stochastic))
    if before.fixed.any() or any(held):
        # With held coefficients, solve the complete problem of each point.
        every = [(part.maximize(model + point, base), model + point) for point in points]
        return sorted(every, key=lambda pair: -pair[0].log_likelihood)
    bins, known = before.matrix.shape
    # One array for all points (about a thousand) and bins (about a thousand).
    effects = known + isinstance(points[0], Stochastic)
    matrices, starts = np.empty((len(points), bins, effects)), np.empty((len(points), effects))
    for point, matrix, start in zip(points, matrices, starts, strict=True):
        start[:known] = base.theta
        matrix[:, :known] = before.matrix
        if isinstance(point, Modifier):
            modified = model + point
            for place, effect in enumerate(model.stochastic):
                if effect.white or point.whole is not None:
                    matrix[:, place] = column_of(modified, effect, part.data)
            continue
        assert isinstance(point, Stochastic)
        column = matrix[:, -1] = column_of(model, point, part.data)
        top = int(np.argmax(column / base.spectrum))
        size = max(float(smooth[top]), 0.03 * float(base.spectrum[top]))
        start[-1] = size / float(column[top])
    found = _maxima_of_selected(matrices, starts, points, base, part)
    order = sorted(found.items(), key=lambda pair: -pair[1].log_likelihood)
    return [(maximum, model + points[i]) for i, maximum in order]


def _maxima_of_selected(
    matrices: Array, starts: Array, points: list[Effect], base: Maximum, part: RandomPart
) -> dict[int, Maximum]:
    """Dict from the index of a grid point to its `Maximum` of the likelihood, only for the most likely points.

    `matrices`, shape (m, bins, p), holds the spectral columns of the model at each point, and `starts`, shape (m, p), the
    squared coefficients to start from. The points with the largest logL after a few steps are kept. Unless the effects are
    bands, this logL is that of the power averaged over groups of bins. The attribute `weight` is copied from `base`.
    """
    narrow = points[0].occupies is not None
    designs = [_design(point) for point in points]
    columns, power, count = matrices, part.power, part.count
    if not narrow:
        columns, power, count = _in_cells(columns, part)

    def best_points(which: NDArray[np.intp], values: Array, min_count: int) -> NDArray[np.intp]:
        """Sorted indices from `which`: the best point of each design (set of choices), and the `min_count` best of all.

        `values` are the logL of the points in `which`. `min_count` is at least `MIN_OPTIMIZED_POINTS`.
        """
        order = which[np.argsort(-values, kind="stable")]
        seen: dict[tuple[object, ...], int] = {}
        for k in map(int, order):
            seen.setdefault(designs[k], k)
        return np.unique([*order[: max(MIN_OPTIMIZED_POINTS, min_count)], *seen.values()])

    climbed = partial(climb_many, power, count, scale=base.scale, cells=not narrow)
    thetas, values, _ = climbed(columns, starts, rounds=SELECTION_STEPS)
    kept = best_points(np.arange(values.size), values, int(SELECTED_FRACTION * values.size))
    thetas, values, scales = climbed(columns[kept], thetas[kept], rounds=RANKING_STEPS)
    if not narrow:
        ranked = best_points(kept, values, MIN_RANKED_POINTS)
        starting = thetas[np.searchsorted(kept, ranked)]
        kept = ranked
        thetas, values, scales = climb_many(
            part.power, part.count, matrices[kept], starting, base.scale, SELECTION_STEPS
        )
    spectra = np.maximum(np.einsum("kbp,kp->kb", matrices[kept], thetas), 1e-300)
    found = zip(thetas, spectra, values.tolist(), scales, strict=True)
    return {int(k): Maximum(*each, base.weight) for k, each in zip(kept, found, strict=True)}


def _in_cells(columns: Array, part: RandomPart) -> tuple[Array, Array, Array]:
    """Tuple (columns, power, count) of cells (groups of bins), shapes (m, cells, p), (cells,) and (cells,).

    `columns`, shape (m, bins, p), and the power of `part` are averaged, weighted by the degrees of freedom of the bins.
    """
    first = cells_of(part.count.size)
    count = np.add.reduceat(part.count, first)
    share = part.count / np.repeat(count, np.diff([*first, part.count.size]))
    power = np.add.reduceat(share * part.power, first)
    return np.add.reduceat(share[:, None] * columns, first, axis=1), power, count


def _smooth(excess: Array, count: Array) -> Array:
    """Array of moving averages of `excess` over five bins (fewer at both ends), weighted by `count`, shape (bins,)."""
    window = np.ones(5)
    total = np.convolve(excess * count, window, mode="same")
    return np.asarray(total / np.convolve(count, window, mode="same"))


def polished_designs(
    scanned: list[tuple[Maximum, Model]], place: int, part: RandomPart
) -> list[tuple[Model, Maximum]]:
    """List of (model, `Maximum`) of the best `scanned` points, after a rough optimization of their shapes.

    `scanned` is sorted, best first. The best two points are taken, and the best point of each design (set of choices),
    because the grid is coarse for long records. A design whose best cutoff lies between two grid points would otherwise
    lose to a worse design with a grid point at its best cutoff. Only the shapes of the effect at index `place` are
    optimized.
    """
    designs: set[tuple[object, ...]] = set()
    out: list[tuple[Model, Maximum]] = []
    for found, model in scanned:
        design = _design(model.effects[place])
        if design not in designs or len(out) < MIN_OPTIMIZED_POINTS:
            designs.add(design)
            shapes = free_shape_parameters(model, place)
            out.append(polish(model, shapes, found, part, roughly=True))
    return out


def free_shape_parameters(model: Model, place: int | None = None) -> list[tuple[int, str]]:
    """List of (index of the effect, name) of every free shape with a number as its value, or those at `place`.

    Deterministic effects are omitted.
    """
    return [
        (i, name)
        for i, effect in enumerate(model.effects)
        if not isinstance(effect, Deterministic) and place in (None, i)
        for name in effect.free_shapes
        if not isinstance(effect.values[name], (str, type(None)))
    ]


def simplest_design(ends: list[tuple[Model, Maximum]], place: int) -> tuple[Model, Maximum]:
    """Pair (model, maximum) in `ends` with the simplest design of the effect at `place` whose logL is within 2 of the best.

    A design is a set of choices, e.g. the type of a filter; `Effect.variants` lists the simplest first. Among equally
    simple designs, the one with the largest logL is returned. `ends` must not be empty.
    """
    top = max(found.log_likelihood for _, found in ends)
    alike = [end for end in ends if end[1].log_likelihood >= top - MAX_SIMPLER_LOSS]
    first = type(alike[0][0].effects[place])()
    ranks = {_design(variant): i for i, variant in reversed([*enumerate(first.variants())])}

    def order(end: tuple[Model, Maximum]) -> tuple[int, float]:
        """Sort key (complexity, −logL) of a pair in `ends`: the simplest design, then the highest logL comes first."""
        return ranks.get(_design(end[0].effects[place]), len(ranks)), -end[1].log_likelihood

    return min(alike, key=order)


def better_form(model: Model, place: int, best: Maximum, part: RandomPart) -> tuple[Model, Maximum]:
    """Pair (model, maximum) with the effect at index `place` in an equivalent form (`Effect.equal_forms`) that fits better.

    The form must raise logL by more than 2; otherwise `model` and `best` are returned.
    """
    found = model, best
    for effect in model.effects[place].equal_forms():
        other = with_effect(model, place, effect)
        places = [(place, name) for name in effect.free_shapes]
        tried = polish(other, places, part.maximize(other, best), part, roughly=True)
        if tried[1].log_likelihood > max(
            found[1].log_likelihood, best.log_likelihood + MAX_SIMPLER_LOSS
        ):
            found = tried
    return found


def _design(effect: Effect) -> tuple[object, ...]:
    """Tuple of the values of an effect's choices, e.g. the type of a filter; empty without choices."""
    return tuple(effect.values[p.name] for p in effect.parameters if p.role == "choice")

"""One more random effect or filter, at every point of its shape grid: where the likelihood has a maximum uphill.

A model that lacks an effect has others standing for it, or has lost the bins where it acts to the discrepancy. So each
point is climbed from where the effect explains the excess at the bin in which it stands out most, beside the model as it
is; and those in the running also from the fit of everything anew in which each bin has about one vote.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Model, Stochastic
from allanite.fit.likelihood.expected import column_of
from allanite.fit.likelihood.whittle import VOTES, Maximum, climb_many, first_guess
from allanite.fit.shapes.polish import polish
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.likelihood.random_part import RandomPart

__all__ = ["added", "other_form", "simplest", "worth_polishing"]

Array = NDArray[np.float64]

#: Points of one design from which shapes are polished.
POLISHED = 2
#: Fisher steps of a scan: enough to tell which starts are in the running, and to rank these.
FIRST, ROUNDS = 3, 12
#: Part of the points that is climbed on, beside the best of every design.
RUNNING = 0.2
#: Of these so many at least are climbed in the bins.
LEADING = 10
#: Designs of an effect whose logL differ by less say the same.
ALIKE = 2.0


def added(
    model: Model, points: list[Effect], base: Maximum, part: RandomPart
) -> list[tuple[Maximum, Model]]:
    """The model with each point of an effect added, and its maximum; best first.

    `base` is the maximum of the model without it.
    """
    smooth = _smooth(part.power - base.spectrum, part.count)
    before = part.linear(model)
    held = (p.coefficient in p.held for p in points if isinstance(p, Stochastic))
    if before.fixed.any() or any(held):
        # Held coefficients: the whole problem of each point by itself.
        return _one_by_one([model + point for point in points], base, part)
    bins, known = before.matrix.shape
    # A thousand points of a thousand bins: one array.
    effects = known + isinstance(points[0], Stochastic)
    matrices, starts = np.empty((len(points), bins, effects)), np.empty((len(points), effects))
    for point, matrix, start in zip(points, matrices, starts, strict=True):
        start[:known] = base.theta
        if not isinstance(point, Stochastic):
            matrix[:] = part.linear(model + point, (model, before)).matrix
            continue
        matrix[:, :-1] = before.matrix
        column = matrix[:, -1] = column_of(model, point, part.data)
        top = int(np.argmax(column / base.spectrum))
        size = max(float(smooth[top]), 0.03 * float(base.spectrum[top]))
        start[-1] = size / float(column[top])
    found = _climbed(matrices, starts, points, base, part)
    order = sorted(found.items(), key=lambda pair: -pair[1].log_likelihood)
    return [(maximum, model + points[i]) for i, maximum in order]


def _climbed(
    matrices: Array,
    starts: Array,
    points: list[Effect],
    base: Maximum,
    part: RandomPart,
) -> dict[int, Maximum]:
    """Where the points end that are in the running after a few steps, by their places.

    Which those are the cells tell, which are fewer than the bins; not for effects that are narrower.
    """
    narrow = points[0].occupies is not None
    designs = [_design(point) for point in points]
    columns, power, count = matrices, part.power, part.count
    if not narrow:
        columns, power, count = _in_cells(columns, part)

    def ahead(which: NDArray[np.intp], values: Array, least: int) -> NDArray[np.intp]:
        """The best of every design among the points of these values, and so many at least of all."""
        order = which[np.argsort(-values, kind="stable")]
        seen: dict[tuple[object, ...], int] = {}
        for k in map(int, order):
            seen.setdefault(designs[k], k)
        return np.unique([*order[: max(POLISHED, least)], *seen.values()])

    def climbed(
        which: NDArray[np.intp], thetas: Array, rounds: int
    ) -> tuple[Array, Array, list[int | None]]:
        return climb_many(
            power, count, columns[which], thetas, base.scale, rounds, cells=not narrow
        )

    thetas, values, _ = climbed(np.arange(len(points)), starts, FIRST)
    kept = ahead(np.arange(values.size), values, int(RUNNING * values.size))
    thetas, values, scales = climbed(kept, thetas[kept], ROUNDS)
    if base.scale is not None:
        # With a discrepancy there are several maxima.
        votes = np.minimum(part.count, VOTES)
        even = np.stack([first_guess(part.power, votes, matrices[k], None) for k in kept])
        others, heights, rough = climbed(kept, even, ROUNDS)
        higher = heights > values
        thetas[higher], values[higher] = others[higher], heights[higher]
        scales = [b if up else a for a, b, up in zip(scales, rough, higher, strict=True)]
    if not narrow:
        place = {int(k): i for i, k in enumerate(kept)}
        kept = ahead(kept, values, LEADING)
        starting = thetas[[place[int(k)] for k in kept]]
        thetas, values, scales = climb_many(
            part.power, part.count, matrices[kept], starting, base.scale, FIRST
        )
    return {
        int(k): Maximum(
            thetas[i],
            np.maximum(matrices[k] @ thetas[i], 1e-300),
            float(values[i]),
            scales[i],
            base.weight,
        )
        for i, k in enumerate(kept)
    }


def _in_cells(columns: Array, part: RandomPart) -> tuple[Array, Array, Array]:
    """Columns (m, cells, p), power and degrees of freedom of the cells, of columns (m, bins, p)."""
    first = cells_of(part.count.size)
    count = np.add.reduceat(part.count, first)
    share = part.count / np.repeat(count, np.diff([*first, part.count.size]))
    power = np.add.reduceat(share * part.power, first)
    return np.add.reduceat(share[:, None] * columns, first, axis=1), power, count


def _one_by_one(
    models: list[Model], base: Maximum, part: RandomPart
) -> list[tuple[Maximum, Model]]:
    found = [(part.maximise(model, base), model) for model in models]
    return sorted(found, key=lambda pair: -pair[0].log_likelihood)


def _smooth(excess: NDArray[np.float64], count: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over five bins, so that no single low or high ordinate sets a scale."""
    window = np.ones(5)
    total = np.convolve(excess * count, window, mode="same")
    return np.asarray(total / np.convolve(count, window, mode="same"))


def worth_polishing(
    scanned: list[tuple[Maximum, Model]], place: int = -1
) -> list[tuple[Maximum, Model]]:
    """Of a scan of one effect, best first: the best point of every design, and `POLISHED` that differ otherwise.

    Neighbours on the grid of the first shape end in the same place. But the grid is coarse beside what a long record
    tells: a design whose best cutoff lies between two points would lose to a worse one that has a point at its own.
    """
    seen: set[tuple[object, ...]] = set()
    designs: set[tuple[object, ...]] = set()
    out = []
    for found, model in scanned:
        effect = model.effects[place]
        first = next((p.name for p in effect.parameters if p.role == "shape"), None)
        apart = [p for p in effect.parameters if p.name != first and p.role != "derived"]
        key = tuple(effect.values[p.name] for p in apart)
        design = _design(effect)
        if key not in seen and (design not in designs or len(seen) < POLISHED):
            out.append((found, model))
            seen.add(key)
            designs.add(design)
    return out


def simplest(ends: list[tuple[Model, Maximum]], place: int) -> tuple[Model, Maximum]:
    """Of models that differ in the effect at `place`: the best, or a simpler design of it that says the same."""
    top = max(found.log_likelihood for _, found in ends)
    alike = [end for end in ends if end[1].log_likelihood >= top - ALIKE]
    first = type(alike[0][0].effects[place])()
    ranks = {_design(variant): i for i, variant in reversed([*enumerate(first.variants())])}

    def order(end: tuple[Model, Maximum]) -> tuple[int, float]:
        return ranks.get(_design(end[0].effects[place]), len(ranks)), -end[1].log_likelihood

    return min(alike, key=order)


def other_form(model: Model, place: int, best: Maximum, part: RandomPart) -> tuple[Model, Maximum]:
    """The model with another form of the effect at `place` (`Effect.otherwise`), where that explains more than it."""
    found = model, best
    for effect in model.effects[place].otherwise():
        other = Model((*model.effects[:place], effect, *model.effects[place + 1 :]))
        places = [(place, name) for name in effect.free_shapes]
        tried = polish(other, places, part.maximise(other, best), part, roughly=True)
        if tried[1].log_likelihood > max(found[1].log_likelihood, best.log_likelihood + ALIKE):
            found = tried
    return found


def _design(effect: Effect) -> tuple[object, ...]:
    return tuple(effect.values[p.name] for p in effect.parameters if p.role == "choice")

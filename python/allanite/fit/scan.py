"""One more random effect or filter, at every point of its shape grid: where the likelihood has a maximum uphill.

A model that lacks an effect has others standing for it, or has lost the bins where it acts to the discrepancy. So each
point is climbed from where the effect explains the excess at the bin in which it stands out most, and a third of it, beside
the model as it is; and from the fit of everything anew in which each bin has about one vote.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Model, Stochastic
from allanite.fit.whittle import VOTES, Maximum, climb_many, first_guess

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.random_part import RandomPart

__all__ = ["added", "simplest", "worth_polishing"]

#: Points of one design from which shapes are polished.
POLISHED = 2
#: Fisher steps of a scan: enough to rank points.
ROUNDS = 12
#: Designs of an effect whose logL differ by less say the same.
ALIKE = 2.0


def added(
    model: Model, points: list[Effect], base: Maximum, part: RandomPart
) -> list[tuple[Maximum, Model]]:
    """The model with each point of an effect added, and its maximum; best first.

    `base` is the maximum of the model without it.
    """
    smooth = _smooth(part.power - base.spectrum, part.count)
    votes = np.minimum(part.count, VOTES)
    models = [model + point for point in points]
    matrices, starts, owner = [], [], []
    for i, (point, tried) in enumerate(zip(points, models, strict=True)):
        linear = part.linear(tried)
        matrix = linear.matrix
        if linear.fixed.any():
            # Held coefficients: the whole problem of each point by itself.
            return _one_by_one(models, base, part)
        own = [first_guess(part.power, votes, matrix, None)]
        if isinstance(point, Stochastic):
            column = matrix[:, -1]
            top = int(np.argmax(column / base.spectrum))
            size = max(float(smooth[top]), 0.03 * float(base.spectrum[top])) / float(column[top])
            own += [np.append(base.theta, size), np.append(base.theta, size / 3.0)]
        else:
            own.append(base.theta)
        starts += own
        matrices += [matrix] * len(own)
        owner += [i] * len(own)
    thetas, values, scales = climb_many(
        part.power, part.count, np.stack(matrices), np.stack(starts), base.scale, ROUNDS
    )
    best: dict[int, int] = {}
    for k, i in enumerate(owner):
        if i not in best or values[k] > values[best[i]]:
            best[i] = k
    order = sorted(best.items(), key=lambda pair: -values[pair[1]])
    return [
        (
            Maximum(
                thetas[k],
                np.maximum(matrices[k] @ thetas[k], 1e-300),
                float(values[k]),
                scales[k],
                base.weight,
            ),
            models[i],
        )
        for i, k in order
    ]


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


def _design(effect: Effect) -> tuple[object, ...]:
    return tuple(effect.values[p.name] for p in effect.parameters if p.role == "choice")

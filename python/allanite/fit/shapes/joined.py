"""Build an effect of free form (unexplained noise) from spectral pieces that explain more than they cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Model, Stochastic
from allanite.fit.models import with_effect, without_effect

if TYPE_CHECKING:
    from allanite.fit.likelihood.random_part import Linear, RandomPart
    from allanite.fit.likelihood.whittle import Maximum

#: Maximum number of pieces of an effect of free form. Chosen by judgment; not measured.
MAX_PIECES = 6
#: Number of least significant pieces whose removal is tried in each round. Chosen by judgment; not measured.
MAX_TRIED_REMOVALS = 4


def indices_of_unbuilt(model: Model, part: RandomPart) -> list[int]:
    """List of the indices of the effects of the model whose simple processes have not yet been chosen.

    Such effects are sums of simple processes (`Stochastic.pieces`); before the choice their parameters are None.
    """
    return [
        place
        for place, effect in enumerate(model.effects)
        if isinstance(effect, Stochastic)
        and type(effect).pieces(part.data.n, part.data.rate)
        and all(effect.values[p.name] is None for p in effect.parameters if p.role == "choice")
    ]


def built_from_pieces(model: Model, place: int, part: RandomPart) -> Model:
    """Copy of the model in which the effect at index `place` becomes the sum of up to six chosen simple processes.

    All simple processes (`pieces`) are first fitted at once, together with the other effects. Processes of zero power
    and the least useful ones are then removed one by one. This ends at six or fewer, when the next removal would lose
    more logL than 2 (two parameters, Akaike 1974) plus ln of the number of pieces. If none is left, or if the model has
    no other noise process, the middle piece is used.
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
    """List of the indices of at most four least significant processes, the least first.

    Indices count from 0 for the column `first` of the linear model. The significance is the squared coefficient over its
    standard error (inverse Fisher information) at the maximum `found`.
    """
    theta = found.theta
    share = linear.matrix * (np.sqrt(0.5 * part.count) / (linear.matrix @ theta))[:, None]
    variance = np.diag(np.linalg.pinv(share.T @ share, hermitian=True))[first:]
    known = theta[first:] ** 2 / np.maximum(variance, 1e-300)
    return [int(i) for i in np.argsort(known)[:MAX_TRIED_REMOVALS]]

"""An effect without a form of its own: the pieces that explain more than they cost, made one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Model, Stochastic
from allanite.fit.likelihood.random_part import Linear

if TYPE_CHECKING:
    from allanite.fit.likelihood.random_part import RandomPart
    from allanite.fit.likelihood.whittle import Maximum

__all__ = ["put_together", "unformed"]

#: Most pieces: with more, a shape is better looked at than described.
MOST = 6
#: Pieces that are tried without, of the ones that are known worst.
TRIED = 4


def unformed(model: Model, part: RandomPart) -> list[int]:
    """Places of effects that are still to be put together."""
    return [
        place
        for place, effect in enumerate(model.effects)
        if isinstance(effect, Stochastic)
        and type(effect).pieces(part.data.n, part.data.rate)
        and all(effect.values[p.name] is None for p in effect.parameters if p.role == "choice")
    ]


def put_together(model: Model, place: int, part: RandomPart) -> Model:
    """The model with the effect at `place` made of the pieces that describe what the others leave.

    All pieces are fitted at once; then the least is taken out while that loses less of logL than it is expected to lose on
    unseen data, two for its numbers (Akaike 1974), and what choosing it among all gives by chance, or there are more than
    `MOST`.
    """
    effect = model.effects[place]
    assert isinstance(effect, Stochastic)
    pieces = type(effect).pieces(part.data.n, part.data.rate)
    others = Model(model.effects[:place] + model.effects[place + 1 :])
    middle = [pieces[len(pieces) // 2]]
    chosen, variances = middle, np.ones(1)
    if others.stochastic:
        linear = part.linear(Model((*others.effects, *pieces)))
        first = linear.matrix.shape[1] - len(pieces)
        found = part.maximise(Model((*others.effects, *pieces)))
        kept, price = np.arange(len(pieces)), 2.0 + np.log(len(pieces))
        while kept.size:
            theta = found.theta[first:]
            tried = (
                _weakest(linear, first, found, part)
                if (theta > 0.0).all()
                else [int(theta.argmin())]
            )
            ends = {i: _without(linear, first + i, found, part) for i in tried}
            least = max(ends, key=lambda i: ends[i].log_likelihood)
            lost = found.log_likelihood - ends[least].log_likelihood
            if (theta > 0.0).all() and kept.size <= MOST and lost > price:
                break
            found = ends[least]
            linear = _taken_out(linear, first + least)
            kept = np.delete(kept, least)
        if kept.size:
            chosen, variances = [pieces[i] for i in kept], found.theta[first:]
    made = type(effect).joined(chosen, [float(v) for v in variances])
    held = {name: effect.values[name] for name in effect.held}
    made = made.with_values(
        **held, hold=effect.hold, limits=effect.limits, at_limit=effect.at_limit
    )
    return Model((*model.effects[:place], made, *model.effects[place + 1 :]))


def _weakest(linear: Linear, first: int, found: Maximum, part: RandomPart) -> list[int]:
    """The pieces known worst, θ over its standard error: one of them is missed least."""
    theta = found.theta
    share = linear.matrix * (np.sqrt(0.5 * part.count) / (linear.matrix @ theta))[:, None]
    variance = np.diag(np.linalg.pinv(share.T @ share, hermitian=True))[first:]
    known = theta[first:] ** 2 / np.maximum(variance, 1e-300)
    return [int(i) for i in np.argsort(known)[:TRIED]]


def _taken_out(linear: Linear, place: int) -> Linear:
    """Without a column."""
    return Linear(
        np.delete(linear.matrix, place, axis=1),
        np.delete(linear.free, place),
        np.delete(linear.fixed, place),
    )


def _without(linear: Linear, place: int, found: Maximum, part: RandomPart) -> Maximum:
    """The maximum without a column, uphill of where the others are."""
    return part.climb(_taken_out(linear, place), np.delete(found.theta, place), found.scale)

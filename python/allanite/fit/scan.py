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
from allanite.fit.whittle import VOTES, first_guess

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.random_part import RandomPart
    from allanite.fit.whittle import Maximum

__all__ = ["added"]

#: Fisher steps of a scan: enough to rank points.
ROUNDS = 12


def added(
    model: Model, points: list[Effect], base: Maximum, part: RandomPart
) -> list[tuple[Maximum, Model]]:
    """The model with each point of an effect added, and its maximum; best first.

    `base` is the maximum of the model without it.
    """
    smooth = _smooth(part.power - base.spectrum, part.count)
    votes = np.minimum(part.count, VOTES)
    found = []
    for point in points:
        tried = model + point
        linear = part.linear(tried)
        offset = linear.offset if linear.fixed.any() else None
        free = linear.matrix[:, linear.free]
        even = linear.fixed.copy()
        even[linear.free] = first_guess(part.power, votes, free, offset)
        starts = [even]
        if isinstance(point, Stochastic):
            column = linear.matrix[:, -1]
            top = int(np.argmax(column / base.spectrum))
            size = max(float(smooth[top]), 0.03 * float(base.spectrum[top])) / float(column[top])
            starts += [np.append(base.theta, size), np.append(base.theta, size / 3.0)]
        else:
            starts.append(base.theta)
        climbed = [part.climb(linear, theta, base.scale, ROUNDS) for theta in starts]
        found.append((max(climbed, key=lambda m: m.log_likelihood), tried))
    return sorted(found, key=lambda pair: -pair[0].log_likelihood)


def _smooth(excess: NDArray[np.float64], count: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over five bins, so that no single low or high ordinate sets a scale."""
    window = np.ones(5)
    total = np.convolve(excess * count, window, mode="same")
    return np.asarray(total / np.convolve(count, window, mode="same"))

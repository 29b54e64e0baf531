"""Candidate lines: the whitened record searched at every frequency."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects.sinusoid import Sinusoid
from allanite.fit.data import density
from allanite.fit.deterministic import line_ordinates, regress, window
from allanite.fit.engine import Solution, solve
from allanite.fit.shape import ZOOM, polish_line
from allanite.suggestion.spectral import Candidate

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["screen_lines"]

#: Below this many cycles in the record a line is a drift.
FEWEST_CYCLES = 4
#: Lines refitted in full, of the strongest ones.
MOST = 2
#: A peak lower than this is not worth a refit: a search of a hundred samples reaches it.
LEAST = 6.0


def _local_level(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the neighbourhood of each ordinate has, at least 1: a band that the model misses is not a line."""
    edges = np.unique(
        np.concatenate(
            [
                np.arange(0, 256, 64),
                np.geomspace(256, power.size, max(2, int(24 * np.log10(power.size / 256 + 1.01)))),
            ]
        ).astype(np.int64)
    )
    edges = np.unique(np.append(edges[edges < power.size - 32], power.size))
    level = np.ones(power.size)
    for low, high in itertools.pairwise(edges):
        level[low:high] = max(1.0, float(np.median(power[low:high])) / np.log(2.0))
    return level


def screen_lines(
    solution: Solution, data: Data, whitened: NDArray[np.float64]
) -> tuple[Candidate, ...]:
    """The strongest lines of the residual (`whitened`, in time), refitted."""
    power = _kernels.padded_periodogram(whitened)
    level = _local_level(power)
    ratio = power / level
    ratio[: 2 * FEWEST_CYCLES] = 0.0
    ratio[-2:] = 0.0
    terms = data.terms(solution.model)
    found: list[Candidate] = []
    for _ in range(MOST):
        top = int(np.argmax(ratio))
        if ratio[top] < LEAST:
            break
        ratio[max(0, top - 8) : top + 9] = 0.0
        start = top * data.rate / (2.0 * data.n)
        frequency = polish_line(start, solution.ordinates, terms, data)
        effect = Sinusoid(frequency=frequency)
        refitted = solve(data, solution.model + effect, polish=False, rounds=3)
        j = window(frequency, data, ZOOM)
        local = (
            regress(
                line_ordinates(frequency, j, data), solution.ordinates[j], density(terms, j, data.n)
            ).gain
            / level[top]
        )
        gain = min(local, refitted.log_likelihood - solution.log_likelihood)
        if gain > 0.0:
            found.append(Candidate(refitted.model.effects[-1], gain, "line", refitted, 3))
    return tuple(found)

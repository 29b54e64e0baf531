"""Corrects predictive losses for functions of time that were fitted to the scored record.

A function of time is fitted to the other blocks of the record and predicts the one left out *given its neighbours* under
the fitted noise (Burman, Chow & Nolan 1994); nothing is extrapolated. What the block loses against the amplitudes of the
whole record is the price of the fit in that block.

The coordinates are the M-point inverse cosine transform of M consecutive ordinates: orthonormal, the m-th one local to the
time (m + ½)/M of the record. The lowest ordinates hold the slow functions, those about its frequency a line. In them the
noise has the precision P = C diag(1/S) Cᵀ.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Periodic
from allanite.fit.likelihood.whitened import expected_level, white_power, whiten
from allanite.fit.shapes.deterministic import window
from allanite.fit.shapes.drifting import ordinates_of_drift
from allanite.fit.shapes.shape import ORDINATES_BESIDE_LINE

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["BLOCKS", "levels", "prices"]

Array = NDArray[np.float64]
#: Blocks of time, each of which is left out once.
BLOCKS = 8
#: Lowest ordinates in which slow functions are predicted.
LOWEST = 512


def prices(data: Data, solution: Solution) -> Array:
    """What the functions of time of a fit cost in each block of the record, nats, shape (BLOCKS,).

    Together at least 1 nat for each fitted number, which is what the noise alone makes a fit look better than it predicts
    (Akaike 1973). Effects that happen once cost no more than that: no other block tells of them.
    """
    total = np.zeros(BLOCKS)
    if not solution.functions:
        return total
    noise = solution.noise(data)

    def unstable(j: NDArray[np.int64], matrix: Array, amplitudes: Array) -> Array:
        rows = matrix[np.searchsorted(solution.seen, j)]
        values = solution.ordinates[j] + (rows * amplitudes).sum(axis=1)
        return lost(values, rows, noise.variance(j), mean=bool(j[0] == 1))

    slow = []
    for own in solution.functions:
        effect = own.effect
        if effect.amplitudes_held:
            continue
        numbers = own.amplitudes.size + len(effect.free_shapes)
        if effect.happens_once:
            total += numbers / BLOCKS
        elif isinstance(effect, Periodic):
            lines = np.zeros(BLOCKS)
            for k, (multiple, _, _) in enumerate(effect.lines):
                j = window(multiple * (effect.frequency or 0.0), data, ORDINATES_BESIDE_LINE)
                pair = slice(2 * k, 2 * k + 2)
                lines += unstable(j, own.matrix[:, pair], own.amplitudes[pair])
            total += _at_least(lines, numbers)
        elif effect.low:
            slow.append(own)
        else:
            j = ordinates_of_drift(effect, data)
            # A wide band by its middle.
            j = j[max(0, j.size // 2 - 2 * LOWEST) : j.size // 2 + 2 * LOWEST]
            total += _at_least(unstable(j, own.matrix, own.amplitudes), numbers)
    if slow:
        j = np.arange(1, min(data.n, LOWEST), dtype=np.int64)
        matrix = np.hstack([own.matrix for own in slow])
        amplitudes = np.concatenate([own.amplitudes for own in slow])
        shapes = sum(len(own.effect.free_shapes) for own in slow)
        total += _at_least(unstable(j, matrix, amplitudes), amplitudes.size + shapes)
    return total


def levels(data: Data, solution: Solution) -> Array:
    """What changes of the noise level cost, less what they explain of the power over time, nats, shape (BLOCKS,).

    They happen once, so that no other block tells of them: 1 nat for each fitted number.
    """
    total = np.zeros(BLOCKS)
    changes = [e for e in solution.model.modifiers if e.passing and e.band is None]
    if not changes:
        return total
    # The power that is left when the changes are taken out, in units of what they make expected.
    power, share, freedom = white_power(solution, data, whiten(solution, data))
    if power is None:
        return total
    expected = 1.0 + share * (expected_level(solution.model, data, power.size) - 1.0)
    loss = 0.5 * freedom * (power - power * expected + np.log(expected))
    times = sum(e.numbers for e in changes)
    return np.array([float(b.sum()) for b in np.array_split(loss, BLOCKS)]) + times / BLOCKS


def _at_least(costs: Array, numbers: int) -> Array:
    return costs + max(0.0, numbers - float(costs.sum())) / BLOCKS


def lost(values: Array, matrix: Array, variance: Array, mean: bool) -> Array:
    """By how much ln p(block | rest) falls where a regression is fitted to the rest alone, shape (BLOCKS,).

    The rest knows the amplitudes a to the precision R; integrated over them, the block is
    ½ (a − â)ᵀ R (a − â) + ½ ln |A|/|R| less likely than with the amplitudes â and the precision A of the whole record. To
    what the rest knows comes one of the k ordinates (a unit-information prior, Kass & Wasserman 1995).

    Parameters
    ----------
    values : ndarray, shape (k,)
        Consecutive ordinates.
    matrix : ndarray, shape (k, p)
        Regressors.
    variance : ndarray, shape (k,)
        Of the noise in each ordinate.
    mean : bool
        True where the ordinate 0, the mean, comes before the first: it is free.
    """
    c = _local(values.size + mean)[:, int(mean) :]
    precision = (c / variance) @ c.T
    # The regressors of whitened ordinates made orthonormal: A = 1 and â is the score.
    root = 1.0 / np.sqrt(variance)
    white = matrix * root[:, None]
    size = np.linalg.norm(white, axis=0)
    white, strength, _ = np.linalg.svd(white / np.where(size > 0.0, size, 1.0), full_matrices=False)
    white = white[:, strength > 1e-6 * strength[0]]
    score = white.T @ (values * root)
    pd, py = c @ (white * root[:, None]), c @ (values / variance)
    out = np.empty(BLOCKS)
    for b, block in enumerate(np.array_split(np.arange(c.shape[0]), BLOCKS)):
        # What the block knows beyond the rest, its neighbours given.
        own = precision[block[0] : block[-1] + 1, block[0] : block[-1] + 1]
        solved = np.linalg.solve(own, np.column_stack([pd[block], py[block]]))
        known, turn = np.linalg.eigh(np.eye(score.size) - pd[block].T @ solved[:, :-1])
        known = np.maximum(known, 1e-9)
        others = (turn.T @ (score - pd[block].T @ solved[:, -1])) / known
        moved = known * (others - turn.T @ score) ** 2
        out[b] = 0.5 * float(np.sum(moved - np.log(np.minimum(known + 1.0 / values.size, 1.0))))
    return out


@lru_cache(maxsize=4)
def _local(m: int) -> Array:
    """Orthonormal inverse cosine transform, shape (m times, m ordinates)."""
    matrix = np.cos(np.pi / m * np.outer(np.arange(m) + 0.5, np.arange(m))) * np.sqrt(2.0 / m)
    matrix[:, 0] = np.sqrt(1.0 / m)
    matrix.flags.writeable = False
    return matrix

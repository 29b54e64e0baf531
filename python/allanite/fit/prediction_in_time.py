"""Correct predictive losses for functions of time that were fitted to the scored record.

A function of time is fitted to all blocks but one and predicts the left-out block *given its neighbors* under the fitted
noise (Burman, Chow & Nolan 1994); nothing is extrapolated. The additional loss of the block, compared with amplitudes from
the whole record, is the price of the fit in that block.

The coordinates are the M-point inverse cosine transform of M consecutive ordinates. It is orthonormal, and value m is local
to the time (m + ½)/M of the record. Slow functions lie in the lowest ordinates, a line near its frequency. In these
coordinates the noise has the precision matrix P = C diag(1/S) Cᵀ.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.fit.likelihood.whitened import expected_level, white_power, whiten
from allanite.fit.shapes.deterministic import ordinates_near
from allanite.fit.shapes.drifting import ordinates_of_drift
from allanite.fit.shapes.shape import ORDINATES_BESIDE_LINE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Regressed, Solution

    #: Indices of consecutive ordinates, regressors at these, and their amplitudes.
    Part = tuple[NDArray[np.int64], Array, Array]

#: Number of blocks of time, each of which is left out once. Chosen by judgment; not measured.
BLOCKS = 8
#: Number of lowest ordinates in which slow functions are predicted. Chosen by judgment; not measured.
PREDICTED_ORDINATES = 512


def function_costs(data: Data, solution: Solution) -> Array:
    """Array of the loss of logL in each block if the functions of time are fitted to the other blocks, nats.

    Its shape is (BLOCKS,). The sum over the blocks is at least 1 nat for each fitted parameter, the expected overfitting
    (Akaike 1973). One-time events cost exactly this, because no other block contains information about them. Functions
    with held amplitudes cost nothing.
    """
    total = np.zeros(BLOCKS)
    if not solution.functions:
        return total
    noise = solution.noise(data)
    for parts, numbers in _predicted_parts(data, solution):
        costs = np.zeros(BLOCKS)
        for j, matrix, amplitudes in parts:
            values = solution.ordinates[j] + (matrix * amplitudes).sum(axis=1)
            costs += block_losses(values, matrix, noise.variance(j), mean=bool(j[0] == 1))
        total += costs + max(0.0, numbers - float(costs.sum())) / BLOCKS
    return total


def _predicted_parts(data: Data, solution: Solution) -> Iterator[tuple[list[Part], int]]:
    """Iterator over pairs: parts of a function of time that are predicted alone, and its number of fitted parameters.

    Each line of a function with harmonics is a part. All slow functions are one part. One-time events have no part.
    """
    slow = []
    for own in solution.functions:
        effect = own.effect
        if effect.amplitudes_held:
            continue
        numbers = own.amplitudes.size + len(effect.free_shapes)
        if effect.happens_once:
            yield [], numbers
        elif effect.periodic:
            lines = []
            for k, (multiple, _, _) in enumerate(effect.lines):
                frequency = multiple * (effect.base_frequency or 0.0)
                pair = slice(2 * k, 2 * k + 2)
                j = ordinates_near(frequency, data, ORDINATES_BESIDE_LINE)
                lines.append((j, _rows(own, j)[:, pair], own.amplitudes[pair]))
            yield lines, numbers
        elif effect.low:
            slow.append(own)
        else:
            j = ordinates_of_drift(effect, data)
            # For a wide band, use only its middle.
            first = max(0, j.size // 2 - 2 * PREDICTED_ORDINATES)
            j = j[first : j.size // 2 + 2 * PREDICTED_ORDINATES]
            yield [(j, _rows(own, j), own.amplitudes)], numbers
    if slow:
        j = np.arange(1, min(data.n, PREDICTED_ORDINATES), dtype=np.int64)
        amplitudes = np.concatenate([own.amplitudes for own in slow])
        shapes = sum(len(own.effect.free_shapes) for own in slow)
        part = j, np.hstack([_rows(own, j) for own in slow]), amplitudes
        yield [part], amplitudes.size + shapes


def _rows(own: Regressed, j: NDArray[np.int64]) -> Array:
    """Array of the regressors of a fitted function of time at the ordinates j, which its regression used, shape (j, p)."""
    return own.matrix[np.searchsorted(own.ordinates, j)]


def level_change_costs(data: Data, solution: Solution) -> Array:
    """Array of cost minus predictive gain of noise-level changes in each block of the record, nats, shape (BLOCKS,).

    Negative where the changes predict the block better. The cost of 1 nat per fitted parameter, as for one-time events,
    is spread evenly over all blocks. All zero without changes of the white-noise level, or if white noise dominates no
    octave.
    """
    total = np.zeros(BLOCKS)
    changes = [e for e in solution.model.modifiers if e.passing and e.band is None]
    if not changes:
        return total
    # Power over time divided by the expected power of the changes.
    power, share, freedom = white_power(solution, data, whiten(solution, data))
    if power is None:
        return total
    expected = 1.0 + share * (expected_level(solution.model, data, power.size) - 1.0)
    loss = 0.5 * freedom * (power - power * expected + np.log(expected))
    times = sum(e.numbers for e in changes)
    return np.array([float(b.sum()) for b in np.array_split(loss, BLOCKS)]) + times / BLOCKS


def block_losses(values: Array, matrix: Array, variance: Array, mean: bool) -> Array:
    """Array of the loss of ln p(block | other blocks) if a regression is fitted only to the others, nats, shape (BLOCKS,).

    Let â and A be the amplitudes and their precision matrix from the whole record, and b and R those from the other blocks.
    Averaged over the posterior of the amplitudes given the other blocks, the block is less likely by
    ½ (b − â)ᵀ R (b − â) + ½ ln |A|/|R|. A unit-information prior (one of the k ordinates, Kass & Wasserman 1995) is added
    to R in the second term.

    Parameters
    ----------
    values : ndarray, shape (k,)
        Consecutive ordinates.
    matrix : ndarray, shape (k, p)
        Regressors at these ordinates.
    variance : ndarray, shape (k,)
        Variance of the noise in each ordinate.
    mean : bool
        True if `values` begin after the ordinate of the mean, whose amplitude is free.
    """
    c = _inverse_cosine_matrix(values.size + mean)[:, int(mean) :]
    precision = (c / variance) @ c.T
    # With orthonormal whitened regressors, A is the identity and â is the score.
    root = 1.0 / np.sqrt(variance)
    white = matrix * root[:, None]
    size = np.linalg.norm(white, axis=0)
    white, strength, _ = np.linalg.svd(white / np.where(size > 0.0, size, 1.0), full_matrices=False)
    white = white[:, strength > 1e-6 * strength[0]]
    score = white.T @ (values * root)
    pd, py = c @ (white * root[:, None]), c @ (values / variance)
    out = np.empty(BLOCKS)
    for b, block in enumerate(np.array_split(np.arange(c.shape[0]), BLOCKS)):
        # Information of the block in addition to the other blocks, given its neighbors.
        own = precision[block[0] : block[-1] + 1, block[0] : block[-1] + 1]
        solved = np.linalg.solve(own, np.column_stack([pd[block], py[block]]))
        known, turn = np.linalg.eigh(np.eye(score.size) - pd[block].T @ solved[:, :-1])
        known = np.maximum(known, 1e-9)
        others = (turn.T @ (score - pd[block].T @ solved[:, -1])) / known
        moved = known * (others - turn.T @ score) ** 2
        out[b] = 0.5 * float(np.sum(moved - np.log(np.minimum(known + 1.0 / values.size, 1.0))))
    return out


@lru_cache(maxsize=4)
def _inverse_cosine_matrix(m: int) -> Array:
    """Array: matrix of the orthonormal inverse cosine transform, shape (m times, m ordinates); cached and read-only."""
    matrix = np.cos(np.pi / m * np.outer(np.arange(m) + 0.5, np.arange(m))) * np.sqrt(2.0 / m)
    matrix[:, 0] = np.sqrt(1.0 / m)
    matrix.flags.writeable = False
    return matrix

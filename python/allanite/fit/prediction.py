"""Predictive score: cross-validated loss of a fitted model on data left out of the fit.

Random effects: the ordinates of each bin are distributed over folds. Coefficients, shapes and discrepancy are fitted
without a fold and predict the power of its ordinates. Functions of time are subtracted as fitted to the whole record. This
makes the loss too small; the difference is added back for each block of time (`function_costs`).

Two models are compared unit by unit (`compare`), so that losses common to both cancel. The scatter of the differences gives
the standard error of their sum (Gneiting & Raftery 2007; blocks: Roberts et al. 2017). If an effect acts in one unit only
(a line), the standard error is as large as the difference, which is conservative.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import SCALES
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.stop_band import is_empty
from allanite.fit.likelihood.whitened import expected_level, white_power, whiten
from allanite.fit.shapes.deterministic import ordinates_near
from allanite.fit.shapes.drifting import ordinates_of_drift
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import free_shape_parameters
from allanite.fit.shapes.shape import ORDINATES_BESIDE_LINE
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Regressed, Solution
    from allanite.spectrum import Bins

    #: Indices of consecutive ordinates, regressors at these, and their amplitudes.
    Part = tuple[NDArray[np.int64], Array, Array]

#: Number of folds of the ordinates. Chosen by judgment; not measured.
FOLDS = 5
#: Minimum number of samples of a record with a predictive score. Chosen by judgment; not measured.
MIN_PREDICTED_SAMPLES = 128
#: Degrees of freedom of a bin without ordinates outside a fold: nearly 0, without divisions by zero.
EMPTY_FOLD_FREEDOM = 1e-6
#: Number of equal blocks into which a record is divided. The functions of time are fitted once without each block, which is
#: then predicted. Chosen by judgment; not measured.
BLOCKS = 8
#: Number of lowest ordinates in which slow functions are predicted. Chosen by judgment; not measured.
PREDICTED_ORDINATES = 512


@dataclass(frozen=True, slots=True)
class Prediction:
    """Cross-validated loss: negative log-likelihood of left-out data, relative to the saturated model.

    `losses` are those of each unit, nats: the folds of every group of bins (ten groups per decade), then blocks of time.
    `score` is their sum divided by the number of bins. Most of the scatter behind `std_error` is common to all models of a
    record; use `compare` to compare two models.
    """

    losses: Array = field(compare=False)
    score: float
    std_error: float

    __repr__ = brief

    def to_dict(self) -> dict[str, float]:
        """Dict of score and std_error, for JSON (``predictive``)."""
        return {"score": self.score, "std_error": self.std_error}


def compare(before: Prediction, after: Prediction) -> tuple[float, float]:
    """Pair: sum of the losses of `after` minus that of `before`, nats, and the standard error of this difference.

    Both are predictions of the same record. The difference is negative if `after` predicts better.
    """
    difference = after.losses - before.losses
    return float(difference.sum()), _std_error(difference)


def predict(data: Data, solution: Solution, raw: Data | None = None) -> Prediction | None:
    """`Prediction`: losses of a fitted model on ordinates and blocks of time left out of the fit.

    `raw` is the record with its outliers, if the model excludes some. The saturated model always refers to the raw record,
    and each outlier costs ln n for its position. None for fewer than 128 samples.
    """
    if data.n < MIN_PREDICTED_SAMPLES:
        return None
    bins, model = data.bins, solution.model
    number, total = bins.folded(solution.ordinates, FOLDS)
    number[:, is_empty(bins)] = total[:, is_empty(bins)] = 0.0
    saturated = total
    if solution.ordinates is not data.ordinates or raw is not None:
        _, saturated = bins.folded((data if raw is None else raw).ordinates, FOLDS)
    used = _regressed_freedom(bins, solution)
    units = np.zeros((FOLDS, bins.groups.size))
    cell = np.searchsorted(cells_of(bins.count.size), np.arange(bins.count.size), side="right")
    for fold in range(FOLDS):
        other_folds = np.arange(FOLDS) != fold
        freedom = (number - used)[other_folds].sum(axis=0)
        power = total[other_folds].sum(axis=0) / np.maximum(freedom, EMPTY_FOLD_FREEDOM)
        unseen = (freedom < 0.05) | (power <= 0.0)
        part = RandomPart(
            data,
            np.where(unseen, solution.spectrum, power),
            np.where(unseen, EMPTY_FOLD_FREEDOM, freedom),
        )
        found = part.climb(part.linear(model), solution.theta, solution.scale)
        _, found = polish(model, free_shape_parameters(model), found, part, roughly=True)
        for g, group in enumerate(np.split(np.arange(bins.count.size), bins.groups[1:])):
            b = group[number[fold][group] > 0]
            if b.size:
                n = number[fold][b]
                power = total[fold][b] / n
                best = -0.5 * float(n @ (np.log(saturated[fold][b] / n) + 1.0))
                units[fold, g] = best - log_likelihood_of_bins(
                    power, n, found.spectrum[b], found.scale, cell[b]
                )
    blocks = (
        function_costs(data, solution)
        + level_change_costs(data, solution)
        + _outlier_costs(data, solution)
    )
    losses = np.concatenate([units.ravel(), blocks])
    size = bins.count.size
    return Prediction(losses, float(losses.sum()) / size, _std_error(losses) / size)


def log_likelihood_of_bins(
    power: Array, count: Array, spectrum: Array, scale: int | None, cell: NDArray[np.int64]
) -> float:
    """logL, nats, of the measured `power` of a few bins under the expected `spectrum`, as by `marginal_likelihood`.

    The model discrepancy δ is `SCALES[scale]`, or 0 for None. `cell` is the number of the group of each bin; the bins of a
    group share one relative error of size δ.
    """
    scales = SCALES[:1] if scale is None else SCALES[scale : scale + 1]
    law = _kernels.Likelihood(count, scales, np.flatnonzero(np.diff(cell, prepend=-1)).tolist())
    power = np.maximum(power, 1e-12 * spectrum)
    return law.judge(power, spectrum, None if scale is None else 0)[0]


def _std_error(losses: Array) -> float:
    """Standard error of the sum of independent losses."""
    return float(np.sqrt(losses.size) * losses.std(ddof=1))


def _regressed_freedom(bins: Bins, solution: Solution) -> Array:
    """Degrees of freedom (leverages) that the fitted amplitudes use in each fold of each bin, shape (FOLDS, bins)."""
    used = np.zeros((FOLDS, bins.count.size))
    place = np.searchsorted(bins.edges, solution.regressed_ordinates, side="right") - 1
    np.add.at(used, (solution.regressed_ordinates % FOLDS, place), solution.leverage)
    return used


def _outlier_costs(data: Data, solution: Solution) -> Array:
    """Penalty in each block of time, nats, shape (BLOCKS,): ln n for each single sample that the model excludes."""
    out = np.zeros(BLOCKS)
    for effect in solution.model.modifiers:
        times = np.array(effect.moments) - data.start
        block = np.clip((times / data.duration * BLOCKS).astype(int), 0, BLOCKS - 1)
        np.add.at(out, block, np.log(data.n))
    return out


def function_costs(data: Data, solution: Solution) -> Array:
    """Loss of logL in each block if the functions of time are fitted to the other blocks, nats, shape (BLOCKS,).

    A function is fitted to all blocks but one and predicts the left-out block *given its neighbors* under the fitted noise
    (Burman, Chow & Nolan 1994); nothing is extrapolated. The additional loss of the block, compared with amplitudes from
    the whole record, is the price of the fit in that block.

    The sum over the blocks is at least 1 nat for each fitted parameter, the expected overfitting (Akaike 1973). One-time
    events cost exactly this, because no other block contains information about them.
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
    """Cost minus predictive gain of noise-level changes in each block of the record, nats, shape (BLOCKS,).

    Negative where the changes predict the block better. The cost of 1 nat per fitted parameter, as for one-time events, is
    spread evenly over all blocks.
    """
    total = np.zeros(BLOCKS)
    changes = [e for e in solution.model.modifiers if e.changes_level and e.band is None]
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
    """Loss of ln p(block | other blocks) if a regression is fitted only to the others, nats, shape (BLOCKS,).

    Let â and A be the amplitudes and their precision matrix from the whole record, and b and R those from the other blocks.
    Averaged over the posterior of the amplitudes given the other blocks, the block is less likely by ½ (b − â)ᵀ R
    (b − â) + ½ ln |A|/|R|. A unit-information prior (one of the k ordinates, Kass & Wasserman 1995) is added to R in the
    second term. `values` are k consecutive ordinates, `matrix`, shape (k, p), regressors at them, and `variance` that of
    the noise. `mean` is True if `values` begin after the ordinate of the mean, whose amplitude is free.
    """
    # Value m of the M-point inverse cosine transform is local to the time (m + ½)/M of the record. The transform C is
    # orthonormal: the noise has the precision matrix C diag(1/S) Cᵀ there.
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

"""Predictive score: cross-validated loss of a fitted model on data left out of the fit.

Random effects: the ordinates of each bin are distributed over folds. Coefficients, shapes and discrepancy are fitted
without a fold and predict the power of its ordinates. Functions of time are subtracted as fitted to the whole record. This
makes the loss too small; the difference is added back for each block of time (`prediction_in_time.function_costs`).

Two models are compared unit by unit (`compare`), so that losses common to both cancel. The scatter of the differences gives
the standard error of their sum (Gneiting & Raftery 2007; blocks: Roberts et al. 2017). If an effect acts in one unit only
(a line), the standard error is as large as the difference, which is conservative.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import SCALES
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.stop_band import is_empty
from allanite.fit.prediction_in_time import BLOCKS, function_costs, level_change_costs
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import free_shape_parameters
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution
    from allanite.spectrum import Bins

#: Number of folds of the ordinates. Chosen by judgment; not measured.
FOLDS = 5
#: Minimum number of samples of a record with a predictive score. Chosen by judgment; not measured.
MIN_PREDICTED_SAMPLES = 128
#: Degrees of freedom of a bin without ordinates outside a fold: nearly 0, without divisions by zero.
EMPTY_FOLD_FREEDOM = 1e-6


@dataclass(frozen=True, slots=True)
class Prediction:
    """Cross-validated loss: negative log-likelihood of left-out data, relative to the saturated model.

    Attributes
    ----------
    losses : ndarray, shape (units,)
        Loss of each unit, nats. Units are the folds of every group of bins (ten groups per decade), then blocks of time.
    score : float
        Sum of the losses divided by the number of bins, nats.
    std_error : float
        Standard error of the score, from the scatter of the losses. Most of it is common to all models of a record; use
        `compare` to compare two models.
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

    Parameters
    ----------
    before, after : Prediction
        Predictions of the same record.

    Returns
    -------
    difference : float
        Negative if `after` predicts better.
    std_error : float
        From the scatter of the differences of the single losses (folds of bins, and blocks of time).
    """
    difference = after.losses - before.losses
    return float(difference.sum()), _std_error(difference)


def predicts_worse(before: Prediction, after: Prediction) -> bool:
    """True if `after` predicts worse than `before` by more than the standard error of the difference."""
    difference, std_error = compare(before, after)
    return difference > std_error


def predict(data: Data, solution: Solution, raw: Data | None = None) -> Prediction | None:
    """`Prediction`: losses of a fitted model on ordinates and blocks of time left out of the fit.

    Parameters
    ----------
    data : Data
    solution : Solution
        Fit to these data.
    raw : Data, optional
        If the model excludes outliers, the record with its outliers. The saturated model always refers to the raw record,
        and each outlier costs ln n for its position.

    Returns
    -------
    Prediction or None
        None if the record is too short (fewer than 128 samples).
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
                units[fold, g] = best - _log_likelihood(
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


def _log_likelihood(
    power: Array, count: Array, spectrum: Array, scale: int | None, cell: NDArray[np.int64]
) -> float:
    """logL, nats, of the measured `power` of a few bins under the expected `spectrum`, as by `marginal_likelihood`.

    `count` holds the degrees of freedom. The model discrepancy δ is `SCALES[scale]`, or 0 for None. `cell` is the number
    of the group of each bin; the bins of a group share one relative error of size δ.
    """
    scales = SCALES[:1] if scale is None else SCALES[scale : scale + 1]
    law = _kernels.Likelihood(count, scales, np.flatnonzero(np.diff(cell, prepend=-1)).tolist())
    power = np.maximum(power, 1e-12 * spectrum)
    return law.judge(power, spectrum, None if scale is None else 0)[0]


def _std_error(losses: Array) -> float:
    """Standard error of the sum of independent losses."""
    return float(np.sqrt(losses.size) * losses.std(ddof=1))


def _regressed_freedom(bins: Bins, solution: Solution) -> Array:
    """Array of the degrees of freedom that the fitted amplitudes use in each fold of each bin, shape (5, bins).

    These are sums of leverages. A fold is one of five interleaved sets of ordinates, for cross-validation.
    """
    used = np.zeros((FOLDS, bins.count.size))
    place = np.searchsorted(bins.edges, solution.regressed_ordinates, side="right") - 1
    np.add.at(used, (solution.regressed_ordinates % FOLDS, place), solution.leverage)
    return used


def _outlier_costs(data: Data, solution: Solution) -> Array:
    """Array of the penalty for single samples that the model excludes, in each block of time, nats, shape (BLOCKS,).

    Each excluded sample costs ln n, where n is the number of samples of the record.
    """
    out = np.zeros(BLOCKS)
    for effect in solution.model.modifiers:
        times = np.array(effect.moments) - data.start
        block = np.clip((times / data.duration * BLOCKS).astype(int), 0, BLOCKS - 1)
        np.add.at(out, block, np.log(data.n))
    return out

"""How well a fitted model predicts what it was not fitted to.

Random effects: the ordinates of each bin are dealt to FOLDS folds; coefficients, shapes and discrepancy are fitted anew
without a fold and predict the power of its ordinates. Functions of time are taken out as fitted to the whole record, which
makes the rest look better than it was predicted; what that is worth is added back block by block
(`prediction_in_time.prices`).

Two models are compared unit by unit (`compare`): what both find hard cancels, and the scatter of the differences says how
far their sum can be trusted (Gneiting & Raftery 2007; Roberts et al. 2017 on blocks). Where all that an effect explains is
in one unit (a line), the standard error is as large as the difference: careful.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import SCALES
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.stop_band import is_empty
from allanite.fit.prediction_in_time import BLOCKS, levels, prices
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.shape import free_places
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whittle import Maximum
    from allanite.fit.solution import Solution
    from allanite.spectrum import Bins

__all__ = ["Prediction", "compare", "predict", "worse"]

Array = NDArray[np.float64]
#: Folds of the ordinates.
FOLDS = 5
#: Fewest samples of which some can be left out.
SHORTEST = 128
#: Degrees of freedom of a bin that a fold leaves empty: none, but that its logarithms exist.
EMPTY = 1e-6


@dataclass(frozen=True, slots=True)
class Prediction:
    """Negative log-likelihood of what was not fitted, above the saturated model (every ordinate of a unit as it was found).

    Attributes
    ----------
    losses : ndarray, shape (units,)
        Of each unit, nats: every fold of every group of bins (ten groups a decade), then every block of time.
    score : float
        Sum of the losses over the number of bins, nats.
    std_error : float
        Standard error of the score, from the scatter of the losses. Most of it is common to all models of a record: two of
        them are told apart by `compare`.
    """

    losses: Array = field(compare=False)
    score: float
    std_error: float

    __repr__ = brief

    def to_dict(self) -> dict[str, float]:
        """The contract's ``predictive``."""
        return {"score": self.score, "std_error": self.std_error}


def compare(before: Prediction, after: Prediction) -> tuple[float, float]:
    """By how much one model of a record predicts it worse than another, and the standard error of that.

    Parameters
    ----------
    before, after : Prediction
        Of the same record.

    Returns
    -------
    difference : float
        Sum of the losses after − before, nats; negative where `after` predicts better.
    std_error : float
        From the scatter of the differences of the units, nats.
    """
    difference = after.losses - before.losses
    return float(difference.sum()), _std_error(difference)


def worse(before: Prediction, after: Prediction) -> bool:
    """Whether `after` predicts worse than `before` by more than the standard error of the difference."""
    difference, std_error = compare(before, after)
    return difference > std_error


def predict(data: Data, solution: Solution, raw: Data | None = None) -> Prediction | None:
    """Losses of a fitted model on ordinates and blocks of time left out of the fit.

    Parameters
    ----------
    data : Data
    solution : Solution
        A fit to these data.
    raw : Data, optional
        Where the model takes outliers out, the record with them: the saturated model is always the raw record's, and each
        outlier costs ln n, the price of pointing at it.

    Returns
    -------
    Prediction or None
        None where the record is too short (fewer than 128 samples).
    """
    if data.n < SHORTEST:
        return None
    bins = data.bins
    number, total = bins.folded(solution.ordinates, FOLDS)
    number[:, is_empty(bins)] = total[:, is_empty(bins)] = 0.0
    saturated = total
    if solution.ordinates is not data.ordinates or raw is not None:
        _, saturated = bins.folded((data if raw is None else raw).ordinates, FOLDS)
    used = _used(bins, solution)
    units = np.zeros((FOLDS, bins.groups.size))
    cell = np.searchsorted(cells_of(bins.count.size), np.arange(bins.count.size), side="right")
    for fold in range(FOLDS):
        rest = np.arange(FOLDS) != fold
        freedom = (number - used)[rest].sum(axis=0)
        power = total[rest].sum(axis=0) / np.maximum(freedom, EMPTY)
        unseen = (freedom < 0.05) | (power <= 0.0)
        part = RandomPart(
            data, np.where(unseen, solution.spectrum, power), np.where(unseen, EMPTY, freedom)
        )
        found = _refitted(solution, part)
        for g, group in enumerate(np.split(np.arange(bins.count.size), bins.groups[1:])):
            b = group[number[fold][group] > 0]
            if b.size:
                n = number[fold][b]
                power = total[fold][b] / n
                best = -0.5 * float(n @ (np.log(saturated[fold][b] / n) + 1.0))
                units[fold, g] = best - _judged(power, n, found.spectrum[b], found.scale, cell[b])
    blocks = prices(data, solution) + levels(data, solution) + _outliers(data, solution)
    losses = np.concatenate([units.ravel(), blocks])
    size = bins.count.size
    return Prediction(losses, float(losses.sum()) / size, _std_error(losses) / size)


def _judged(
    power: Array, count: Array, spectrum: Array, scale: int | None, cell: NDArray[np.int64]
) -> float:
    """`discrepancy.judge` of a few bins, whose tables no other call will need: at one scale alone."""
    scales = SCALES[:1] if scale is None else SCALES[scale : scale + 1]
    law = _kernels.Likelihood(count, scales, np.flatnonzero(np.diff(cell, prepend=-1)).tolist())
    power = np.maximum(power, 1e-12 * spectrum)
    return law.judge(power, spectrum, None if scale is None else 0)[0]


def _std_error(losses: Array) -> float:
    """Of a sum of independent numbers."""
    return float(np.sqrt(losses.size) * losses.std(ddof=1))


def _used(bins: Bins, solution: Solution) -> Array:
    """Degrees of freedom that the regression used in each fold of each bin, shape (FOLDS, bins)."""
    used = np.zeros((FOLDS, bins.count.size))
    place = np.searchsorted(bins.edges, solution.seen, side="right") - 1
    np.add.at(used, (solution.seen % FOLDS, place), solution.leverage)
    return used


def _refitted(solution: Solution, part: RandomPart) -> Maximum:
    """The maximum of the same model uphill of its values, on other ordinates."""
    model = solution.model
    found = part.climb(part.linear(model), solution.theta, solution.scale)
    _, found = polish(model, free_places(model), found, part, roughly=True)
    return found


def _outliers(data: Data, solution: Solution) -> Array:
    """Price of the single samples named in each block, each chosen among all."""
    out = np.zeros(BLOCKS)
    for effect in solution.model.modifiers:
        times = np.array(effect.moments) - data.start
        block = np.clip((times / data.duration * BLOCKS).astype(int), 0, BLOCKS - 1)
        np.add.at(out, block, np.log(data.n))
    return out

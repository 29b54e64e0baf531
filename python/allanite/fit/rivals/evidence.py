"""The evidence of a fitted model: its log-likelihood less what its numbers cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.solution import Process, Regressed

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Fitted, Solution

__all__ = ["RIVAL", "cost", "evidence", "gained", "of_number", "over_true", "price"]

#: ln(evidence) within which two models cannot be told apart (20 : 1).
RIVAL = 3.0
#: A number may lie anywhere in so many natural logarithms before the record is seen: three decades.
RANGE = float(np.log(1e3))


def price(solution: Solution) -> float:
    """½ ln n of the effective observations: what a number costs in BIC (Schwarz 1978)."""
    return 0.5 * float(np.log(max(solution.weight.sum(), 2.0)))


def cost(own: Fitted, solution: Solution) -> float:
    """What the numbers of a fitted effect cost in ln of the evidence.

    A strength or a time constant that the record knows to a share of 1/z costs ln(range · z/√2π), Laplace's approximation
    (Kass & Raftery 1995, J. Am. Stat. Assoc. 90, eq. 5) for a logarithm that is equally likely over `RANGE`: few ordinates
    speak of a drift, whatever the length of the record. What has a
    place among all ordinates or times pays ½ ln n.
    """
    effect = own.effect
    if effect.occupies is not None:
        return effect.numbers * price(solution)
    if effect.screened == "spectral" and isinstance(own, Process):
        share = own.power / solution.spectrum
        square = 2.0 * float(solution.weight @ share**2)
    elif effect.screened == "slow" and isinstance(own, Regressed):
        inverse = np.linalg.pinv(own.covariance, hermitian=True)
        square = float(own.amplitudes @ inverse @ own.amplitudes)
    else:
        return effect.numbers * price(solution)
    return effect.numbers * of_number(square)


def of_number(square: float) -> float:
    """Cost of a number with relative error 1/√square."""
    return float(np.log(RANGE * np.sqrt(max(square, 1.0) / (2.0 * np.pi))))


def evidence(solution: Solution) -> float:
    """Ln of the evidence of a fitted model, up to what all models of a record share."""
    return solution.log_likelihood - sum(cost(own, solution) for own in solution.effects)


def over_true(solution: Solution, data: Data) -> float:
    """By how much logL with a fitted discrepancy exceeds that of the model taken for true."""
    if solution.best.scale is None:
        return 0.0
    part = RandomPart(data, solution.power, solution.count)
    plain = part.climb(part.linear(solution.model), solution.theta, None)
    return max(part.judged(solution.best) - plain.log_likelihood, 0.0)


def gained(after: Solution, before: Solution, data: Data) -> float:
    """Ln of the evidence of one model over that of another; what a larger discrepancy brings explains nothing."""
    more = max(0.0, over_true(after, data) - over_true(before, data))
    return evidence(after) - evidence(before) - more

"""Log-evidence of a fitted model: its log-likelihood minus a cost for each parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.rivals.line_trials import expected_line_gain
from allanite.fit.solution import Fitted, Process, Regressed, Solution

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data

#: Maximum difference in ln evidence of two models that the record cannot distinguish: odds of 20 : 1, "strong" evidence
#: in Kass & Raftery (1995). Screens ignore a smaller ΔlogL.
MAX_RIVAL_LOG_EVIDENCE = 3.0
#: Width of the prior of the logarithm of a parameter: three decades. Chosen by judgment; not measured.
PRIOR_LOG_RANGE = float(np.log(1e3))


def bic_cost(solution: Solution) -> float:
    """Cost of one parameter in ln evidence by BIC, nats: ½ ln n, n being the effective degrees of freedom."""
    return 0.5 * float(np.log(max(solution.weight.sum(), 2.0)))


def parameters_cost(own: Fitted, solution: Solution) -> float:
    """Cost of all parameters of a fitted effect in ln evidence, nats.

    - Random processes and slow functions of time: ln(R·z/√2π) for each parameter with relative error 1/z. R is
      `PRIOR_LOG_RANGE`. This is Laplace's approximation (Kass & Raftery 1995, J. Am. Stat. Assoc. 90, eq. 5) with a uniform
      prior of the logarithm. Such effects are determined by few ordinates, however long the record is.
    - The frequency of a band: R is replaced by the number of all ordinates divided by the number of ordinates in the band.
    - Lines, filters, changes of level and nameless processes (`Effect.nameless`): ½ ln n for each parameter, n being the
      effective degrees of freedom of all bins (`bic_cost`). A line at an expected frequency costs less
      (`expected_line_gain`).

    The number of parameters is `Effect.numbers`. A sinusoid has its frequency, and two for each line; one more for the
    spacing of lines that are not harmonics, or three for each line if the lines share no frequency (`Sinusoid.numbers`).
    """
    effect = own.effect
    if isinstance(own, Process) and not effect.nameless:
        share = own.power / solution.spectrum
        informative = float(solution.weight @ share**2)
        cost = effect.numbers * parameter_cost(2.0 * informative)
        if effect.occupies is None or informative == 0.0:
            return cost
        ordinates = float(solution.weight @ share) ** 2 / informative
        return cost + float(np.log(solution.weight.sum() / ordinates / PRIOR_LOG_RANGE))
    if isinstance(own, Regressed) and own.effect.low:
        inverse = np.linalg.pinv(own.covariance, hermitian=True)
        return effect.numbers * parameter_cost(float(own.amplitudes @ inverse @ own.amplitudes))
    if isinstance(own, Regressed) and (frequency := own.effect.base_frequency) is not None:
        data = solution.residual.data
        gain = expected_line_gain(frequency * data.duration, data.n, data.rate)
        return effect.numbers * bic_cost(solution) - gain
    return effect.numbers * bic_cost(solution)


def parameter_cost(square: float) -> float:
    """Cost in ln evidence, nats, of one parameter with relative error 1/√square, if its logarithm ranges over 3 decades.

    A `square` below 1 counts as 1.
    """
    return float(np.log(PRIOR_LOG_RANGE * np.sqrt(max(square, 1.0) / (2.0 * np.pi))))


def evidence(solution: Solution) -> float:
    """Log-evidence of a fitted model, nats: logL minus a cost for each parameter.

    Comparable between models that exclude the same samples and have the same `changing_effects`.
    """
    return solution.log_likelihood - sum(parameters_cost(own, solution) for own in solution.effects)


def discrepancy_gain(solution: Solution, data: Data) -> float:
    """Gain of logL of a fit by its model discrepancy δ: compared with the same model at δ = 0, nats, at least 0.

    The logL with the discrepancy is reduced by the 3 nats that a claim of δ > 0 needs. At δ = 0 only the coefficients are
    fitted again.
    """
    if solution.best.scale is None:
        return 0.0
    part = RandomPart(data, solution.power, solution.count)
    plain = part.climb(part.linear(solution.model), solution.theta, None)
    return max(part.log_likelihood_of(solution.best) - plain.log_likelihood, 0.0)


def evidence_gain(after: Solution, before: Solution, data: Data) -> float:
    """Ln evidence of `after` minus that of `before`, nats, without the gain that comes from a larger model discrepancy.

    If the discrepancy raises the logL of `after` by more than that of `before` (`discrepancy_gain`), the excess is
    subtracted.
    """
    more = max(0.0, discrepancy_gain(after, data) - discrepancy_gain(before, data))
    return evidence(after) - evidence(before) - more

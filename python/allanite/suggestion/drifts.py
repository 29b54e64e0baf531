"""Candidate slow functions of time: ramps and other regressors of the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects.rate_ramp import RateRamp
from allanite.fit.engine import Solution, solve
from allanite.suggestion.spectral import Candidate, Screen

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["screen_drifts"]


def screen_drifts(solution: Solution, data: Data) -> Screen:
    """Refitted candidates that drift."""
    if any(e.kind == "rate_ramp" for e in solution.model.effects):
        return Screen((), ())
    refitted = solve(data, solution.model + RateRamp(), rounds=4)
    gain = refitted.log_likelihood - solution.log_likelihood
    found = (Candidate(refitted.model.effects[-1], gain, "drift", refitted, 1),) if gain > 0 else ()
    return Screen(found, (0.0,))

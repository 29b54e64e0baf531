"""The two ends of a record of differences: two numbers that every ordinate shows.

A counter hands out differences x_k = p_{k+1} − p_k of a phase with white noise. In each of their ordinates there are
±p_n − p_0 beside what the phase between them does, which falls with the frequency. Where nothing else is above them,
hundreds of the lowest ordinates show these two numbers and little else: as many independent ones would scatter far less,
and whatever fits two large or small numbers looks like an effect. The two are in the first and in the last sample alone.
Without these the other ordinates are independent, exactly, and show again what is below the ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit.likelihood.data import without_samples
from allanite.fit.likelihood.expected import means

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["without_ends"]

#: Variance that the ends may add to that of a fit. The mean square of p_n − p_0 and p_n + p_0 has a relative variance of
#: 1, by which all ordinates move together, each by the share s of the ends in it; of independent ones that mean would
#: have 1/(½ Σ n s²). A tenth widens what is told there by 5 %.
NOTICED = 0.1


def without_ends(data: Data, solution: Solution) -> Data | None:
    """The record without its first and last sample where, under the model, what the ends add matters; else None."""
    if data.ends_out or data.ordinates.size != data.n:
        return None
    if all(term.inside is term for term in data.terms(solution.model)):
        return None
    whole, inside = (means(solution.model, data, ends_out) for ends_out in (False, True))
    share = 1.0 - inside / np.maximum(whole, 1e-300)
    if 0.5 * float(data.bins.count @ share**2) <= NOTICED:
        return None
    ends = np.zeros(data.n, dtype=bool)
    ends[[0, -1]] = True
    return without_samples(data, ends)

"""Mask the first and last sample of records of differences, whose ends leak into every ordinate.

A counter outputs differences x_k = p_{k+1} − p_k of a phase with white noise. Each ordinate contains ±p_n − p_0, in
addition to the differenced phase noise, which falls toward low frequencies. If nothing else exceeds them, hundreds of the
lowest ordinates show only these two random numbers. The ordinates are then not independent, and two large or small
numbers can imitate an effect. The two numbers affect only the first and the last sample. Without these samples the
ordinates are exactly independent, and weaker low-frequency noise becomes visible.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit.likelihood.data import without_samples
from allanite.fit.likelihood.expected import expected_power

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Maximum of ½ Σ n s² (share s of the ends in a bin of n ordinates) up to which the ends are not masked. It is the ratio of
#: two relative variances of a fitted level. The two random numbers at the ends change all ordinates together and add the
#: variance 1. Independent ordinates have the variance 1/(½ Σ n s²). The value widens intervals by 5 %.
MAX_ADDED_VARIANCE = 0.1


def without_ends(data: Data, solution: Solution) -> Data | None:
    """Copy of the data with the first and last sample masked; None if leakage from the ends of the record is negligible.

    Leakage is negligible if ½ Σ n s² ≤ 0.1, summed over bins. Here n is the degrees of freedom of a bin, and s is the
    part of its expected power that is leakage. None is also returned for summaries, and if both ends are already missing.
    """
    if not data.whole or data.ends_missing:
        return None
    if all(term.inside is term for term in data.terms(solution.model)):
        return None
    whole, inside = (
        expected_power(solution.model, data, ends_missing) for ends_missing in (False, True)
    )
    share = 1.0 - inside / np.maximum(whole, 1e-300)
    if 0.5 * float(data.bins.count @ share**2) <= MAX_ADDED_VARIANCE:
        return None
    ends = np.zeros(data.n, dtype=bool)
    ends[[0, -1]] = True
    return without_samples(data, ends)

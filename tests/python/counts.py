"""How many records a statistical test simulates: few, whose bound knows how few, or all of them.

`make test-all` takes the few. ALLANITE_FULL=1, which benches/claims/full_counts.py sets, takes the full numbers.
"""

import os

import pytest

FULL = bool(os.environ.get("ALLANITE_FULL"))


def records(few, full):
    """`few`, and `full` where all are asked for."""
    return full if FULL else few


def halves(one, seeds, clean):
    """Results of `one(seed)`: of the first half of the seeds where they are `clean`, else of all of them.

    Where one failure in ten is allowed, five without any pass too. What fails in 3 % of records fails such a test in 2.7 %
    (all ten at once: 3.5 %); what fails in 30, 50 and 70 % of them passes it in 23, 3.6 and 0.3 % (15, 1.1 and 0.01 %).
    """
    seeds = list(seeds)
    middle = len(seeds) if FULL else (len(seeds) + 1) // 2
    found = [one(seed) for seed in seeds[:middle]]
    return found if clean(found) else found + [one(seed) for seed in seeds[middle:]]


def nightly(cases, *slow):
    """The cases of a parametrized test, of which the `slow` ones run every night and not in CI."""
    return [pytest.param(c, marks=pytest.mark.long) if c in slow else c for c in cases]

"""Number of records that statistical tests simulate: a few, with bounds that account for this, or all of them.

`make test-all` uses few records. ALLANITE_FULL=1, set by benches/claims/full_counts.py, uses the full numbers.
"""

import os

import pytest

FULL = bool(os.environ.get("ALLANITE_FULL"))


def records(few, full):
    """The number `few`, or `full` if ALLANITE_FULL is set."""
    return full if FULL else few


def halves(one, seeds, clean):
    """Results of `one(seed)` for the first half of the seeds if these results are `clean`, else for all seeds.

    With one allowed failure in ten, five records without a failure pass too. A fault in 3 % of records fails such a
    test with a probability of 2.7 % (always using all ten: 3.5 %). Faults in 30, 50 and 70 % of records pass it with
    23, 3.6 and 0.3 % (15, 1.1 and 0.01 %).
    """
    seeds = list(seeds)
    middle = len(seeds) if FULL else (len(seeds) + 1) // 2
    found = [one(seed) for seed in seeds[:middle]]
    return found if clean(found) else found + [one(seed) for seed in seeds[middle:]]


def nightly(cases, *slow):
    """Cases of a parametrized test; the `slow` ones run only in the nightly tests."""
    return [pytest.param(c, marks=pytest.mark.long) if c in slow else c for c in cases]

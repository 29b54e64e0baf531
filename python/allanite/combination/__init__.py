"""Several sensors of one axis as one sensor.

Input: recordings of the units (`combine`). Output: a `Combination` with weights, gains, correlation and the unit that
deviates. Add a result in `combine.py`.
"""

from __future__ import annotations

from allanite.combination.combine import Combination, combine

__all__ = ["Combination", "combine"]

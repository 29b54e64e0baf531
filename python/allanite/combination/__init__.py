"""Several sensors (units) that measure one axis, averaged to one sensor.

Input: recordings of the units (`combine`). Output: a `Combination` with weights, gains, correlations, and units whose
noise differs from that of the others. Add new results to `combine.py`.
"""

from __future__ import annotations

from allanite.combination.combine import Combination, combine

__all__ = ["Combination", "combine"]

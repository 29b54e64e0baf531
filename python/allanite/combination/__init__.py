"""Several sensors (units) that measure one axis, averaged to one sensor (`combine`); add new results to `combine.py`."""

from __future__ import annotations

from allanite.combination.combine import Combination, combine

__all__ = ["Combination", "combine"]

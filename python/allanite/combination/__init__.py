"""Several sensors of one axis: recordings of the units go in, weights, gains and the deviating unit come out.

`correlation.py` says what the units share, `deviating.py` which unit is not like the others, `combine.py` what averaging
gains. A new figure or document of the result belongs into `combine.py`.
"""

from __future__ import annotations

from allanite.combination.combine import Combination, combine

__all__ = ["Combination", "combine"]

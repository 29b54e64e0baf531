"""The Allan curve of stretches: one accumulator, or several about what is missing between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from allanite.deviation import Deviation
    from allanite.deviation.accumulator import Accumulator

__all__ = ["curve_of"]

#: Missing samples given at a time.
CHUNK = 1 << 20


def curve_of(curves: list[Accumulator]) -> Deviation:
    """The curve of accumulators in the order of time; what is between two is a gap."""
    if len(curves) == 1:
        return curves[0].oadev()
    whole = curves[0].__copy__()
    for following in curves[1:]:
        end = whole.start + whole.n
        while end < following.start:
            size = min(CHUNK, following.start - end)
            whole.update(np.full(size, np.nan))
            end += size
        whole.merge(following)
    return whole.oadev()

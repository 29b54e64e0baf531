"""Allan curve of a summary: one accumulator per segment, with gaps between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from allanite.deviation import Deviation
    from allanite.deviation.accumulator import Accumulator

#: Missing samples that are added at a time; limits the memory.
MISSING_AT_ONCE = 1 << 20


def curve_of(curves: list[Accumulator]) -> Deviation:
    """Allan deviation of a whole stream from the accumulators of its segments in time order.

    Samples between segments are missing.
    """
    if len(curves) == 1:
        return curves[0].oadev()
    whole = curves[0].__copy__()
    for following in curves[1:]:
        end = whole.start + whole.n
        while end < following.start:
            size = min(MISSING_AT_ONCE, following.start - end)
            whole.update(np.full(size, np.nan))
            end += size
        whole.merge(following)
    return whole.oadev()

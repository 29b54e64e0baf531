"""Jumps of a phase: permanent steps, and single outliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.documents import fields_dict

Array = NDArray[np.float64]
#: Probability that a record with normal increments and without jumps has a false jump.
FALSE_ALARM_PROBABILITY = 0.01
#: If less than this fraction of a jump remains at the next sample, the sample is an outlier. Chosen by judgment; not
#: measured.
MIN_REMAINING_FRACTION = 0.5
#: Standard deviation of a normal distribution divided by the median of its absolute values.
NORMAL_OVER_MEDIAN = 1.4826


@dataclass(frozen=True)
class Jump:
    """A jump of the phase.

    Attributes
    ----------
    time : float
        Time of the first sample after the jump, s from the first sample of the record.
    height : float
        Height of the jump, s.
    stays : bool
        True for a permanent step, False for a single outlier.
    row : int
        Index of the first sample after the jump; missing samples are not counted.
    """

    time: float
    height: float
    stays: bool
    row: int

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: time_s, height_s and stays."""
        return fields_dict(self, time="time_s", height="height_s", row="")


def jumps_of(times: Array, values: Array) -> list[Jump]:
    """Permanent steps, and outliers of a single sample, of a phase (s) in order of time (s).

    The median frequency is subtracted first. A jump is a change between neighboring samples that is too large for
    normal noise: among all changes of a record, noise exceeds this limit in one record of a hundred. After a pause of k
    sampling intervals, the limit is k times as large. A jump is an outlier if less than half of it remains after the
    next change; that change is then no jump of its own.
    """
    from scipy.special import ndtri

    spans = np.diff(times)
    usual = float(np.median(spans))
    step = np.diff(values)
    moving = spans > 0.0
    step = step - spans * np.median(step[moving] / spans[moving])
    size = np.abs(step) / np.maximum(spans / usual, 1.0)
    spread = NORMAL_OVER_MEDIAN * float(np.median(size))
    if spread == 0.0:
        # More than half of the samples repeat their predecessor, as with a coarse counter: its resolution is the spread.
        spread = float(size[size > 0.0].min(initial=np.inf))
    limit = -float(ndtri(0.5 * FALSE_ALARM_PROBABILITY / max(step.size, 1))) * spread
    rows = np.flatnonzero(size > limit)
    out: list[Jump] = []
    skip = -1
    for row in rows.tolist():
        if row == skip:
            continue
        following = step[row + 1] if row + 1 < step.size else 0.0
        stays = abs(step[row] + following) >= MIN_REMAINING_FRACTION * abs(step[row])
        if not stays:
            skip = row + 1
        out.append(Jump(float(times[row + 1]), float(step[row]), bool(stays), row + 1))
    return out

"""Jumps of a phase: steps that stay, and single samples far off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Jump", "jumps_of"]

Array = NDArray[np.float64]
#: False-alarm probability over all samples of a record with normal increments.
FALSE_ALARM = 0.01
#: A step that the next sample takes back to less than this part of it is a single sample far off.
BACK = 0.5
#: Standard deviation of a normal distribution over the median of its absolute values.
NORMAL = 1.4826


@dataclass(frozen=True)
class Jump:
    """A jump of the phase.

    Attributes
    ----------
    time : float
        Time of the first sample after it, s from the first sample.
    height : float
        s.
    stays : bool
        False of a single sample far off.
    row : int
        Number of that sample among those that are there.
    """

    time: float
    height: float
    stays: bool
    row: int


def jumps_of(times: Array, values: Array) -> list[Jump]:
    """Return jumps: changes from one sample to the next that normal increments make once in a hundred records.

    Parameters
    ----------
    times : ndarray, shape (n,)
        s.
    values : ndarray, shape (n,)
        Phase, s.
    """
    from scipy.special import ndtri

    step = np.diff(values)
    step = step - np.median(step)
    size = np.abs(step)
    spread = NORMAL * float(np.median(size))
    if spread == 0.0:
        # More than half of the samples repeat the last one: a counter with one step of resolution.
        spread = float(size[size > 0.0].min(initial=np.inf))
    limit = -float(ndtri(0.5 * FALSE_ALARM / max(step.size, 1))) * spread
    rows = np.flatnonzero(size > limit)
    out: list[Jump] = []
    skip = -1
    for row in rows.tolist():
        if row == skip:
            continue
        following = step[row + 1] if row + 1 < step.size else 0.0
        stays = abs(step[row] + following) >= BACK * size[row]
        if not stays:
            skip = row + 1
        out.append(Jump(float(times[row + 1]), float(step[row]), bool(stays), row + 1))
    return out

"""Base class of bands whose frequency moves: one frequency for each of several equal segments of the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.common.former import Former
from allanite.effects._base import Stochastic
from allanite.effects._declared import Array


@dataclass(frozen=True)
class Moving(Stochastic):
    """A random process with a different spectrum in each segment of the record, with gradual transitions.

    Examples
    --------
    >>> fan = al.effects.DriftingResonance(course=(11.0, 10.0), damping=0.02, rms=0.1)
    >>> fan.middles
    (11.0, 10.0)
    >>> print(fan.segments[0], al.effects.DriftingResonance.like(al.GaussMarkov(), course=(11.0, 10.0)))
    RES(frequency=11, damping=0.02, rms=0.1) None
    """

    screened = "moving band"
    family = "course"
    moving = True

    along = Former("like", lambda cls, band, course: cls.like(band, course=tuple(course)))


def segment_weights(time: Array, span: tuple[float, float], parts: int) -> Array:
    """Weight of each of `parts` equal segments of a record at given times, for interpolation; shape (parts, times).

    A segment has weight 1 at its middle, and weights change linearly from one middle to the next. Before the first
    middle and after the last one, that segment has weight 1. `span` is the first and last time of the record, s.
    """
    start, end = span
    at = np.clip((time - start) / (end - start) * parts - 0.5, 0.0, parts - 1.0)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(at - np.arange(parts)[:, None])))

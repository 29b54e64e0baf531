"""Disturbance: a time segment in which something moved the sensor; its samples are excluded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Parameter, texts_for_clocks
from allanite.effects._modifier import Modifier


@dataclass(frozen=True)
class Disturbance(Modifier):
    """Samples from `start` to `end` count as missing; the recording keeps them.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> x = rng.normal(0, 0.1, 60_000)
    >>> x[30_000:32_000] += 0.3 * np.sin(0.4 * np.cumsum(rng.random(2000)))  # carried for 20 s
    >>> check = al.AngleRandomWalk().fit(al.Recording(x, rate=100)).check()
    >>> first = check.suggestions[0]
    >>> first.kind, first.effect.start > 299.0, first.effect.end < 321.0
    ('disturbance', True, True)
    """

    start: float | None = None
    end: float | None = None

    kind = "disturbance"
    short = "DIST"
    catalog_place = 37
    common = True
    title = "disturbance"
    screened = "stretch"
    family = "stretch"
    removes = True
    interval = ("start", "end")
    unplanned = "its evidence is a band that is louder for a while: twice the noise is detected"
    parameters = (
        Parameter("start", "s", "first time of the segment", "time"),
        Parameter("end", "s", "last time of the segment", "time"),
    )
    physics = "for a while the sensor was moved (carried, knocked, shaken by a machine or a vehicle), or its link was lost"
    looks_like = "a segment of the samples unlike the rest; a band of the spectrum that is louder for a while"
    check_by = "look at the samples and at the laboratory's log for that time; record again where nothing moves"
    texts = texts_for_clocks(
        physics="the clock or its link was disturbed for a while: a cable moved, packets were late, the reference changed",
        check_by="look at the phase and at the laboratory's log for that time; record again without the disturbance",
    )
    rivals = ("noise_level_change", "outliers", "resonance")

    @property
    def moments(self) -> tuple[float, ...]:
        """Pair (start, end) of the segment, s; empty without values."""
        return self.when or ()

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Mask of n samples at `rate` Hz: True within the segment, both ends included; all False without values."""
        mask = np.zeros(n, dtype=bool)
        if self.when is not None:
            first, last = (round(min(max(t * rate, 0.0), n - 1.0)) for t in self.when)
            mask[first : last + 1] = True
        return mask

"""Outliers: single samples larger than the noise allows; they are excluded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.effects._declared import Parameter, texts_for_clocks
from allanite.effects._modifier import Modifier


@dataclass(frozen=True)
class Outliers(Modifier):
    """Samples at `times` count as missing; the recording keeps them.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(0, 0.1, 6000)
    >>> x[[1000, 4000]] = 3.0
    >>> check = al.AngleRandomWalk().fit(al.Recording(x, rate=10)).check()
    >>> [(s.kind, s.effect.count) for s in check.significant]
    [('outliers', 2.0)]
    """

    count: float | None = None
    times: tuple[float, ...] | None = None

    kind = "outliers"
    short = "OUT"
    catalog_place = 38
    common = True
    title = "outliers"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "outliers or phase steps"}
    screened = "outlier"
    family = "outlier"
    single = True
    removes = True
    unplanned = (
        "its evidence is the size of single samples: one beyond 6 standard deviations is detected"
    )
    legend = ("count",)
    parameters = (
        Parameter("count", "1", "number of outliers", "time", optional=True),
        Parameter("times", "s", "times of the outliers", "time"),
    )
    physics = "single wrong samples: transmission errors, resets, shocks, saturated conversions, mains switching"
    looks_like = (
        "spikes of the samples; a white density (and N) higher than the width of the histogram"
    )
    check_by = "look at the raw words and checksums at these times; count them against a bus or supply event"
    texts = texts_for_clocks(
        physics="single wrong readings, or steps of the phase: another path or reference, a reset, a slipped cycle",
        looks_like="spikes of the frequency; a white FM (and N) that the rest of the record does not have",
        check_by="compare the phase before and after these times; look for switched paths and restarts",
    )
    rivals = ("noise_level_change", "warm_up")

    __repr__ = brief

    @property
    def moments(self) -> tuple[float, ...]:
        """Tuple of the times of the outliers, s from the first sample; empty without values."""
        return self.times or ()

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Mask of n samples at `rate` Hz: True for the sample nearest to each of `times` within the record."""
        mask = np.zeros(n, dtype=bool)
        if self.times:
            index = np.round(np.asarray(self.times) * rate).astype(np.int64)
            mask[index[(index >= 0) & (index < n)]] = True
        return mask

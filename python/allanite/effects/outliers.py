"""Outliers: isolated samples beyond what the noise allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.effects._base import Modifier, Parameter

if TYPE_CHECKING:
    from allanite.effects.terms import Term


@dataclass(frozen=True)
class Outliers(Modifier):
    """Samples at `times` are taken as missing; the recording keeps them."""

    count: float | None = None
    times: tuple[float, ...] | None = None

    kind: ClassVar[str] = "outliers"
    short: ClassVar[str] = "OUT"
    title: ClassVar[str] = "outliers"
    #: Found over time, not by the spectrum.
    suggested: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("count", "1", "number of outliers", "time"),
        Parameter("times", "s", "when they happened", "time"),
    )
    physics: ClassVar[str] = (
        "single wrong samples: transmission errors, resets, shocks, saturated conversions, mains switching"
    )
    looks_like: ClassVar[str] = (
        "spikes of the samples; a white density (and N) higher than the histogram's width says"
    )
    check_by: ClassVar[str] = (
        "look at the raw words and checksums at these times; count them against a bus or supply event"
    )
    rivals: ClassVar[tuple[str, ...]] = ("noise_level_change",)

    __repr__ = brief

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """The white part is what remains; nothing to change."""
        return (("white", (white,)),)

    def missing(self, n: int, rate: float) -> NDArray[np.bool_]:
        """Mask of the n samples that are outliers."""
        mask = np.zeros(n, dtype=bool)
        if self.times:
            index = np.round(np.asarray(self.times) * rate).astype(np.int64)
            mask[index[(index >= 0) & (index < n)]] = True
        return mask

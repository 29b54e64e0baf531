"""The filter of a `Bandwidth` that acts on all random processes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from allanite.effects import lowpass
from allanite.effects._filter import Filter, Response

if TYPE_CHECKING:
    from allanite.effects._base import Parameter


@dataclass(frozen=True)
class LowPass(Filter):
    """A low-pass filter of a recursive design on all random processes; `cutoff` in Hz."""

    design: str = "sampled"
    order: int = 1
    cutoff: float = 1.0

    kind: ClassVar[str] = "bandwidth"
    short: ClassVar[str] = "BW"
    title: ClassVar[str] = "low-pass filter"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def response(self, rate: float) -> Response:
        """`Response` of the recursive low-pass `design` at sampling rate `rate`, Hz."""
        return lowpass.response(self.design, self.order, self.cutoff / rate)

"""The filter of a `Bandwidth` that acts on all random processes."""

from __future__ import annotations

from dataclasses import dataclass

from allanite.effects import lowpass
from allanite.effects._filter import Filter, Response


@dataclass(frozen=True)
class LowPass(Filter):
    """A low-pass filter of a recursive design on all random processes; `cutoff` in Hz."""

    design: str = "sampled"
    order: int = 1
    cutoff: float = 1.0

    kind = "bandwidth"
    short = "BW"
    title = "low-pass filter"
    parameters = ()

    def response(self, rate: float) -> Response:
        """`Response` of the recursive low-pass `design` at sampling rate `rate`, Hz."""
        return lowpass.response(self.design, self.order, self.cutoff / rate)

"""What a `Bandwidth` is that acts on all that is random: a filter like any other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from allanite.effects import lowpass
from allanite.effects._filter import Filter, Response

if TYPE_CHECKING:
    from allanite.effects._base import Parameter

__all__ = ["LowPass"]


@dataclass(frozen=True)
class LowPass(Filter):
    """A low-pass of a recursive design; its cutoff in Hz."""

    design: str = "sampled"
    order: int = 1
    cutoff: float = 1.0

    kind: ClassVar[str] = "bandwidth"
    short: ClassVar[str] = "BW"
    title: ClassVar[str] = "low-pass filter"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def response(self, rate: float) -> Response:
        """The low-pass at this rate."""
        return lowpass.response(self.design, self.order, self.cutoff / rate)

"""What an audit finds: one record a finding; and the findings of time stamps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from allanite.recording.timebase import Stamps

__all__ = ["Finding", "of_stamps"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is odd about the data.

    Attributes
    ----------
    kind : str
        Machine name: ``rate``, ``jitter``, ``gaps``, ``quantisation``, ``outliers``, …
    severity : str
        ``"info"`` (worth knowing) or ``"warning"`` (will distort a result if ignored).
    message : str
        One sentence for a person, with the numbers and the remedy.
    column : str or None
        Column concerned; None for the whole recording.
    values : mapping of str to float
        The numbers, in SI or the unit of the samples.
    """

    kind: str
    severity: str
    message: str
    column: str | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "kind": self.kind,
            "severity": self.severity,
            "message": self.message,
            "column": self.column,
            **self.values,
        }

    def __str__(self) -> str:
        return self.message


def of_stamps(stamps: Stamps, rate: float) -> Iterator[Finding]:
    """Yield what is odd about time stamps, beside the rate stated."""
    if abs(stamps.rate / rate - 1) > max(1e-3, 3 * stamps.resolution * stamps.rate / stamps.n):
        yield Finding(
            "rate",
            "warning",
            f"the time column says {stamps.rate:.4g} Hz, not {rate:g} Hz: give the right one"
            " with --rate",
            values={"stated_hz": rate, "measured_hz": stamps.rate},
        )
    if stamps.guessed and stamps.unit != "s":
        yield Finding(
            "time_unit",
            "info",
            f"time stamps taken as {stamps.unit} from their magnitude ({stamps.rate:.6g} Hz);"
            " --rate overrides",
            values={"measured_hz": stamps.rate},
        )
    shared = stamps.coarse and stamps.duplicates > 0.2 * stamps.n
    if shared:
        yield Finding(
            "coarse_time",
            "info",
            f"time stamps resolve {stamps.resolution:.3g} s, not single samples: their mean rate is"
            f" {stamps.rate:.5g} Hz, and gaps cannot be found from them",
            values={"resolution_s": stamps.resolution, "measured_hz": stamps.rate},
        )
    elif stamps.duplicates:
        yield Finding(
            "duplicate_stamps",
            "warning",
            f"{stamps.duplicates} time stamps repeat the one before: samples may be duplicated",
            values={"count": stamps.duplicates},
        )
    if stamps.backwards:
        yield Finding(
            "out_of_order",
            "warning",
            f"{stamps.backwards} time stamps run backwards, the first in row"
            f" {stamps.first_backwards}; samples are used in the order of the file",
            values={"count": stamps.backwards, "row": stamps.first_backwards},
        )
    if not shared and stamps.jitter * stamps.rate > 0.05:
        yield Finding(
            "jitter",
            "warning" if stamps.jitter * stamps.rate > 0.3 else "info",
            f"spacing of the time stamps varies by {stamps.jitter * 1e3:.3g} ms rms"
            f" ({stamps.jitter * stamps.rate:.0%} of the interval); samples are taken as regular"
            + (", and gaps cannot be found" if stamps.coarse else ""),
            values={"rms_s": stamps.jitter},
        )
    if stamps.gaps:
        longest = max(count for _, count in stamps.gaps)
        yield Finding(
            "gaps",
            "warning",
            f"{len(stamps.gaps)} gaps in the time column, {stamps.missing} samples missing, the"
            f" longest {longest / stamps.rate:.3g} s; kept as NaN",
            values={"count": len(stamps.gaps), "missing": stamps.missing, "longest": longest},
        )

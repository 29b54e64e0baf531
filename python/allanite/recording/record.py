"""What every record of a sensor states, whether its samples are at hand or only their sums."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.recording.findings import Finding


class Record(Protocol):
    """A record: `Recording`, `Summary`, or a log of which only the Allan deviation was computed.

    Attributes
    ----------
    rate : float
        Sampling rate, Hz.
    columns, units : tuple of str
        Name and unit of each column.
    path : str or None
        File of the log.
    """

    __slots__ = ()

    rate: float
    columns: tuple[str, ...]
    units: tuple[str, ...]
    path: str | None

    @property
    def n(self) -> int:
        """Samples from the first to the last, missing ones included."""

    @property
    def gaps(self) -> int:
        """Runs of missing samples."""

    @property
    def audit(self) -> Sequence[Finding]:
        """Findings about the samples."""

    @property
    def whole(self) -> bool:
        """True if every sample is at hand, as time series and fits of single samples need it."""

    @property
    def tau0(self) -> float:
        """Sampling interval, s."""
        return 1.0 / self.rate

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.n / self.rate

    @property
    def unit(self) -> str:
        """Unit of the rate; of several units all are named."""
        return ", ".join(dict.fromkeys(self.units))

    def describe(self) -> dict[str, Any]:
        """JSON record: path, column, n, rate_hz, duration_s, unit, gaps, audit."""
        return {
            "path": self.path,
            "column": ", ".join(self.columns),
            "n": self.n,
            "rate_hz": self.rate,
            "duration_s": self.duration,
            "unit": self.unit,
            "gaps": self.gaps,
            "audit": [finding.to_dict() for finding in self.audit],
        }

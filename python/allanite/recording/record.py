"""Properties that recordings and summaries share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

from allanite.common.errors import InputError
from allanite.recording.findings import Finding

if TYPE_CHECKING:
    from allanite.recording.recording import Recording


class Record(Protocol):
    """A record of one or several columns: a `Recording` or a `Summary`."""

    __slots__ = ()

    rate: float
    columns: tuple[str, ...]
    units: tuple[str, ...]
    path: str | None

    @property
    def n(self) -> int:
        """Number of samples from the first to the last, with missing samples."""

    @property
    def keeps_all_samples(self) -> bool:
        """True if every sample is at hand; a `Summary` keeps only the samples of short records."""

    def recording(self) -> Recording:
        """`Recording` with all samples. Raises `InputError` if they are not kept."""

    @property
    def gaps(self) -> int:
        """Number of runs of missing samples."""

    @property
    def audit(self) -> Sequence[Finding]:
        """Sequence of `Finding`: findings about the samples and time stamps."""

    @property
    def tau0(self) -> float:
        """Sampling interval, s."""
        return 1.0 / self.rate

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return self.n / self.rate

    @property
    def unit(self) -> str:
        """Unit of the rate; columns with different units give all units: ``deg/s, m/s^2``."""
        return ", ".join(dict.fromkeys(self.units))

    def _require_one_column(self) -> None:
        """Raise `InputError` unless the record has exactly one column."""
        if len(self.columns) != 1:
            raise InputError(
                f"one column is needed, found {', '.join(self.columns)}: choose with column(name)"
            )

    def describe(self) -> dict[str, Any]:
        """Dict for JSON with the keys path, column, n, rate_hz, duration_s, unit, gaps, audit."""
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

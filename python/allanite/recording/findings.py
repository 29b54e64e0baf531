"""Findings of an audit, and the findings about time stamps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from allanite.common.errors import CALL, remedy_text
from allanite.common.numbers import percent_text, with_readable_numbers
from allanite.recording.timebase import Stamps

#: Share of longer steps above which the sampling is irregular: about half of the samples are then next to one.
MIN_IRREGULAR_SHARE = 0.25


@dataclass(frozen=True, slots=True)
class Finding:
    """One irregularity of the data.

    Attributes
    ----------
    kind : str
        Machine name: ``rate``, ``jitter``, ``gaps``, ``quantisation``, ``outliers``, …
    severity : str
        ``"info"`` (worth knowing) or ``"warning"`` (will distort a result if ignored).
    found : str
        Sentence with the numbers.
    column : str or None
        Column concerned; None for the whole recording.
    values : mapping of str to float
        Numbers of the finding, in SI or the unit of the samples.
    remedy : str
        Clause on what to do, appended to `found`; its parameters are those of `allanite.common.errors`.
    """

    kind: str
    severity: str
    found: str
    column: str | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    remedy: str = ""

    @property
    def message(self) -> str:
        """Sentence of the finding with its remedy, in the words of the Python library."""
        return self.worded()

    def worded(self, words: Mapping[str, str] = CALL) -> str:
        """Sentence of the finding with its remedy; `words` gives the name to print for each parameter."""
        return with_readable_numbers(self.found) + remedy_text(self.remedy, words)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: kind, severity, message, column, and each entry of `values`."""
        return {
            "kind": self.kind,
            "severity": self.severity,
            "message": self.message,
            "column": self.column,
            **self.values,
        }

    def __str__(self) -> str:
        return self.message


def names_text(names: Sequence[str]) -> str:
    """Text of some names: ``GyrX, GyrY``; for four or more the first and the last, ``GyrX … AccZ``."""
    return ", ".join(names) if len(names) < 4 else f"{names[0]} … {names[-1]}"


def merged(findings: Iterable[Finding]) -> list[Finding]:
    """Findings, with equal findings for several columns joined, ``gx, gy: …``, in place of the first."""
    columns: dict[tuple[str, str, str], list[str]] = {}
    first: dict[tuple[str, str, str], Finding] = {}
    for one in findings:
        prefix = "" if one.column is None else f"{one.column}: "
        key = (one.severity, one.found.removeprefix(prefix), one.remedy)
        first.setdefault(key, one)
        own = columns.setdefault(key, [])
        if one.column is not None and one.column not in own:
            own.append(one.column)
    return [
        replace(one, found=f"{names_text(columns[key])}: {key[1]}")
        if len(columns[key]) > 1
        else one
        for key, one in first.items()
    ]


def stamp_findings(stamps: Stamps, rate: float) -> Iterator[Finding]:
    """Yield findings about the time stamps of a recording whose sampling rate is `rate`, Hz."""
    # Several samples share each stamp, as whole seconds in a faster log.
    shared = stamps.coarse and stamps.duplicates > 0.2 * stamps.n
    yield from _rate_findings(stamps, rate)
    yield from _jump_findings(stamps)
    yield from _restart_findings(stamps)
    yield from _order_findings(stamps, shared=shared)
    yield from _spacing_findings(stamps, shared=shared)
    yield from _gap_findings(stamps)


def _rate_findings(stamps: Stamps, rate: float) -> Iterator[Finding]:
    """Findings about a rate of the stamps that differs from `rate` (Hz), and about a guessed unit.

    The rates differ by over 0.1 %, and by more than the resolution of the stamps explains.
    """
    if abs(stamps.rate / rate - 1) > max(1e-3, 3 * stamps.resolution * stamps.rate / stamps.n):
        yield Finding(
            "rate",
            "warning",
            f"the time column says {stamps.rate:.4g} Hz, not {rate:g} Hz",
            values={"stated_hz": rate, "measured_hz": stamps.rate},
            remedy=": check {rate}",
        )
    if stamps.guessed:
        yield Finding(
            "time_unit",
            "info",
            f"time stamps taken as {stamps.unit} from their magnitude ({stamps.rate:.6g} Hz)",
            values={"measured_hz": stamps.rate},
            remedy="; {rate} overrides",
        )


def _restart_findings(stamps: Stamps) -> Iterator[Finding]:
    """Findings about time stamps that begin anew, and about the first three rows after which time runs back."""
    if stamps.wraps:
        yield Finding(
            "wraps",
            "info",
            f"the time column is a counter that begins anew every {stamps.wrap:.8g} s,"
            f" {len(stamps.wraps)} times, first after row {stamps.wraps[0]}: the count continues",
            values={"count": len(stamps.wraps), "row": stamps.wraps[0], "span_s": stamps.wrap},
        )
    for row, by in stamps.seams[:3]:
        yield Finding(
            "seam",
            "warning",
            f"time runs back by {by:.6g} s after row {row}: logs joined, or a clock set back; the"
            " seam is a gap of one sample, of unknown length"
            + (f" ({len(stamps.seams)} such in all)" if len(stamps.seams) > 1 else ""),
            values={"row": row, "back_s": by, "count": len(stamps.seams)},
        )


def _order_findings(stamps: Stamps, *, shared: bool) -> Iterator[Finding]:
    """Findings about stamps that repeat the one before, or are earlier.

    If several samples share each stamp (`shared`), the resolution of the stamps is stated instead of the repeats.
    """
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
            f"{stamps.duplicates} time stamps repeat the one before, first in row"
            f" {stamps.first_duplicate}: samples may be duplicated",
            values={"count": stamps.duplicates, "row": stamps.first_duplicate},
        )
    if stamps.backwards > len(stamps.seams):
        yield Finding(
            "out_of_order",
            "warning",
            f"{stamps.backwards} time stamps run backwards, the first in row"
            f" {stamps.first_backwards}; samples are used in the order of the file",
            values={"count": stamps.backwards, "row": stamps.first_backwards},
        )


def _spacing_findings(stamps: Stamps, *, shared: bool) -> Iterator[Finding]:
    """Findings about jitter over 5 % of the interval, unless samples share stamps (`shared`), and about a drift."""
    if not shared and stamps.jitter * stamps.rate > 0.05:
        yield Finding(
            "jitter",
            "warning" if stamps.jitter * stamps.rate > 0.3 else "info",
            ("irregular sampling: " if stamps.jitter * stamps.rate > 0.3 else "")
            + f"spacing of the time stamps varies by {stamps.jitter * 1e3:.3g} ms rms"
            f" ({percent_text(stamps.jitter * stamps.rate)} of the interval); samples are taken as evenly spaced"
            " (except by timing and trend)"
            + (", and short gaps cannot be found" if stamps.lost else ""),
            values={"rms_s": stamps.jitter},
        )
    if stamps.drift:
        moved = stamps.changed >= 0
        yield Finding(
            "clock_drift",
            "warning" if moved else "info",
            f"the interval of the time stamps changes by {_relative_text(stamps.drift)} over the record"
            + (f", most about row {stamps.changed}" if moved else "")
            + "; samples are taken as evenly spaced (except by timing and trend)",
            values={"relative": stamps.drift},
        )


def _gap_findings(stamps: Stamps) -> Iterator[Finding]:
    """At most one `Finding` about missing samples in the used segment; rows where time runs back are not counted."""
    gaps = [gap for gap in stamps.gaps_in_segment if gap[0] not in {row for row, _ in stamps.seams}]
    if gaps:
        row, longest = max(gaps, key=lambda gap: gap[1])
        missing = sum(count for _, count in gaps)
        several = f", first after row {gaps[0][0]}" if len(gaps) > 1 else ""
        found = (
            f"{len(gaps)} gap{'s' * (len(gaps) > 1)} in the time column{several}, {missing} samples"
            f" missing, the longest {longest / stamps.rate:.3g} s after row {row}; kept as NaN"
        )
        first, end = stamps.rows
        if len(gaps) > MIN_IRREGULAR_SHARE * (end - first):
            found = (
                f"irregular sampling: {len(gaps)} of {end - first - 1} steps of the time column are up to {longest + 1}"
                f" times the usual {1.0 / stamps.rate:.4g} s; the {missing} samples between are kept as NaN"
            )
        yield Finding(
            "gaps",
            "warning",
            found,
            values={"count": len(gaps), "missing": missing, "longest": longest, "row": row},
        )


def _jump_findings(stamps: Stamps) -> Iterator[Finding]:
    """At most one `Finding` about jumps of time that split the record; names at most four segments."""
    if len(stamps.pieces) < 2:
        return
    first, end = stamps.rows
    missing = max(count for _, count in stamps.gaps)
    shown = [f"{a}–{b - 1}" for a, b in stamps.pieces[:4]]
    more = f" and {len(stamps.pieces) - 4} more" if len(stamps.pieces) > 4 else ""
    yield Finding(
        "pieces",
        "warning",
        f"the time column jumps by up to {missing / stamps.rate:.4g} s: the record has"
        f" {len(stamps.pieces)} segments, rows {', '.join(shown)}{more}. Segment {stamps.piece + 1} is used:"
        f" rows {first}–{end - 1}, {percent_text((end - first) / stamps.n)} of the samples",
        values={"count": len(stamps.pieces), "first_row": first, "last_row": end - 1},
        remedy=" ({piece} selects another segment; {rate} without the time column joins all)",
    )


def _relative_text(share: float) -> str:
    """Text of a relative change: in ppm if it is below 10⁻³ (``20 ppm``), otherwise in percent (``0.25 %``)."""
    return f"{1e6 * share:.3g} ppm" if share < 1e-3 else percent_text(share, 2)

"""Findings about a log as sentences, with buttons that apply the proposed remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.numbers import duration_text

if TYPE_CHECKING:
    from allanite.recording.findings import Finding


def capitalized(text: str) -> str:
    """The text with a capital letter, unless its first word has digits or capitals, such as a column ``gx1``."""
    head = text.split(" ", 1)[0].rstrip(",.:")
    return text[:1].upper() + text[1:] if head.islower() and head.isalpha() else text


def remedy_buttons(finding: Finding, rate: float, duration: float) -> list[dict[str, Any]]:
    """List of at most one button (a dict with the keys ``text`` and ``act``) that remedies a finding."""
    values = finding.values
    if finding.kind == "rate" and "measured_hz" in values:
        found = float(values["measured_hz"])
        return [{"text": f"Use {found:.5g} Hz", "act": {"do": "rate", "rate": found}}]
    if "quiet_start_s" in values:
        length = float(values["quiet_end_s"]) - float(values["quiet_start_s"])
        text = f"Use the quiet {duration_text(length)}"
        return [{"text": text, "act": {"do": "take", "quiet": True}}]
    if finding.kind == "not_static":
        return [_longer_part_button(float(values["start_s"]), float(values["end_s"]), duration)]
    if finding.kind == "seam":
        at = float(values["row"]) / rate
        return [{**_longer_part_button(at, at + 1.0 / rate, duration), "text": "Split at the seam"}]
    return []


def _longer_part_button(start: float, end: float, duration: float) -> dict[str, Any]:
    """Dict of a button (``text``, ``act``) that keeps only the longer part of the log before or after a segment, in s."""
    first, last = (end, duration) if duration - end > start else (0.0, start)
    text = f"Use only {first:.4g}–{last:.4g} s"
    return {"text": text, "act": {"do": "take", "from": first, "to": last}}

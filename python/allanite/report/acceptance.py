"""Acceptance report of a part: one page with the record, every figure with its limit, the verdict, and a plot."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.numbers import duration_text, number
from allanite.common.plain import plain
from allanite.comparison.acceptance import DOES_NOT_MEET, MEETS
from allanite.report.blocks import Block, Bullets, Heading, Paragraph, Picture, Table
from allanite.report.html import blocks_html, html_skeleton
from allanite.report.summary import temperature_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.comparison.acceptance import Acceptance

#: Height of the plot, inches, chosen so that the report fits on one page of A4.
PLOT_HEIGHT = 3.6


def acceptance_page(found: Sequence[Acceptance], serial: str = "", date: str = "") -> str:
    """Complete HTML page of the acceptance report on all axes of a part; plots the first with the overall verdict."""
    first = found[0]
    verdict = overall_verdict(found)
    sheet = first.sheet.name
    title = f"Acceptance test: {sheet}" + (f", serial number {serial}" if serial else "")
    tone = {MEETS: "good", DOES_NOT_MEET: "bad"}.get(verdict, "plain")
    words = f"The part {verdict} the data sheet."
    if verdict not in (MEETS, DOES_NOT_MEET):
        needs = max((a.needs for a in found if a.needs is not None), default=None)
        words = "The verdict is undecided." + (
            f" A record of {duration_text(needs)} would probably settle it." if needs else ""
        )
    blocks: list[Block] = [
        Paragraph(words, tone),
        Table((), tuple(_description_rows(found, serial, date))),
        Heading("Figures"),
        Table(
            ("axis", "figure", "data sheet", "limit", "measured", "95 % interval", "verdict"),
            tuple(
                (
                    a.recording.columns[0],
                    f.figure.name.replace("_", " "),
                    f.with_unit(number(f.figure.value, 4)),
                    *f.texts,
                    f.verdict,
                )
                for a in found
                for f in a.figures
            ),
            (3, 4),
        ),
    ]
    remarks = [
        f"{a.recording.columns[0]}, {f.figure.name.replace('_', ' ')}: {f.remark}"
        for a in found
        for f in a.figures
        if f.remark
    ]
    remarks += [f"{a.recording.columns[0]}: {r}" for a in found for r in a.remarks]
    if remarks:
        blocks.append(Bullets(tuple(dict.fromkeys(remarks))))
    worst = next((a for a in found if a.verdict == verdict), first)
    caption = (
        f"Allan deviation of {worst.recording.columns[0]} with the fitted model {worst.study.fit.model.name}"
        " and the limits of the data sheet."
    )
    blocks.append(Picture(worst.plot(), caption, "acceptance", PLOT_HEIGHT))
    content = f"<header>\n<h1>{escape(title)}</h1>\n</header>\n" + blocks_html(blocks)
    return html_skeleton(title, content)


def overall_verdict(found: Sequence[Acceptance]) -> str:
    """Verdict on the part: ``"does not meet"`` if any axis does not, ``"meets"`` if all do, else ``"undecided"``."""
    verdicts = {a.verdict for a in found}
    if DOES_NOT_MEET in verdicts:
        return DOES_NOT_MEET
    return MEETS if verdicts == {MEETS} else "undecided"


def _description_rows(found: Sequence[Acceptance], serial: str, date: str) -> list[tuple[str, str]]:
    """Rows (name, text) that describe the part, the test, and the record, with up to two warnings of the audit."""
    first = found[0]
    recording = first.recording
    rows = [
        ("data sheet", first.sheet.name),
        ("serial number", serial or "not given"),
        ("date", date or "not given"),
        ("log", Path(recording.path).name if recording.path else "recording"),
        ("record", f"{duration_text(recording.duration)} at {recording.rate:.6g} Hz"),
        ("temperature", temperature_text(recording)),
    ]
    if first.sheet.temperature:
        rows.append(("temperature of the data sheet", first.sheet.temperature))
    if first.margin:
        rows.append(("margin", f"{100 * first.margin:g} % added to the data sheet's values"))
    warnings = [f.message for f in recording.audit if f.severity == "warning"]
    return [(name, plain(text)) for name, text in rows] + [("note", w) for w in warnings[:2]]

"""First section of a report on several columns: all axes together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.axes.rows import convention, legend, rows
from allanite.axes.words import common_form_sentences, remarks, shared_effect_sentences
from allanite.report.blocks import Block, Bullets, Heading, Paragraph, Picture, Table
from allanite.report.words import COMPLETED, as_sentence

if TYPE_CHECKING:
    from allanite.axes import Characterization


def overview_blocks(found: Characterization) -> list[Block]:
    """Blocks on all axes: a table per sensor, the common model, shared effects, and remarks."""
    out: list[Block] = [Heading("All axes", 2)]
    for sensor in found.common.sensors:
        studies = {name: found.studies[name] for name in sensor.columns}
        body = tuple((row.label, *row.cells) for row in rows(studies))
        out += [
            Heading(sensor.name[0].upper() + sensor.name[1:]),
            Table(("", *sensor.columns), body),
            Paragraph(legend(studies), "quiet"),
        ]
        shared = tuple(as_sentence(text) for text in common_form_sentences(sensor))
        if shared:
            out.append(Bullets(shared))
    stated = convention(study.fit for study in found.studies.values())
    if stated:
        out.append(Paragraph(f"{stated}.", "quiet"))
    seen = tuple(shared_effect_sentences(found.common))
    if seen:
        out.append(Heading("Effects found on several axes"))
        out.append(Bullets(seen))
    doubts = tuple(as_sentence(text) for text in remarks(found))
    if doubts:
        out.append(Bullets(doubts, "bad"))
    return out


def axes_picture(found: Characterization) -> Picture:
    """`Picture` of the Allan deviation of every axis with its last model, for the first page."""
    caption = "Measured Allan deviation of every axis with 95 % intervals, and the last model of each axis."
    if any(study.fit.data.missing is not None for study in found.studies.values()):
        caption += f" {COMPLETED}"
    return Picture(found.plot(), caption, "axes", 4.4)

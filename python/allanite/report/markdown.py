"""Reports as Markdown, with figures in separate files."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from allanite import _kernels
from allanite.common.files import whole_file
from allanite.common.plain import file_name
from allanite.report.blocks import Block, Bullets, Card, Heading, Paragraph, Picture, Table
from allanite.report.ending import report_sections
from allanite.report.summary import title_and_line

if TYPE_CHECKING:
    from allanite.report.document import Report


def markdown_text(report: Report, figures: str | None = None) -> str:
    """Markdown text of a report; `figures` is the folder of the figures, as a link."""
    return _text_of_sections(report, report_sections(report), figures)


def save_markdown(report: Report, target: Path) -> None:
    """Write a report as Markdown to `target`, and its figures as SVG to a folder next to it."""
    folder = target.with_name(f"{target.stem}_figures")
    sections = report_sections(report)
    with whole_file(target) as draft:
        draft.write_text(_text_of_sections(report, sections, folder.name), encoding="utf-8")
        new = not folder.exists()
        folder.mkdir(exist_ok=True)
        try:
            _write_figures(sections, folder)
        except BaseException:
            if new:
                shutil.rmtree(folder, ignore_errors=True)
            raise


def _text_of_sections(
    report: Report, sections: list[tuple[str, list[Block]]], figures: str | None
) -> str:
    """Markdown text of the sections of a report (`report_sections`), with links to figures in the folder `figures`."""
    title, line = title_and_line(report)
    out = [f"# {_escape(title)}", _escape(f"Noise report · {line} · allanite {_kernels.version()}")]
    for name, blocks in sections:
        if name and len(report.entries) > 1:
            out.append(f"## {_escape(name)}")
        out += [t for block in blocks if (t := _block_markdown(block, name, figures))]
    return "\n\n".join(out) + "\n"


def _write_figures(sections: list[tuple[str, list[Block]]], folder: Path) -> None:
    """Write all figures in the sections of a report as SVG to a folder."""
    from allanite.plots.matplotlib_painter import render

    for name, blocks in sections:
        for block in blocks:
            if isinstance(block, Picture):
                figure = replace(block.figure, title="", subtitle="")
                content = render(figure, "svg", "light", (block.width, block.height))
                with whole_file(folder / _figure_file_name(name, block)) as draft:
                    draft.write_bytes(content)


def _figure_file_name(column: str, picture: Picture) -> str:
    """File name of a figure: ``column-name.svg``, or ``name.svg`` without a column."""
    return f"{file_name(column)}-{picture.name}.svg" if column else f"{picture.name}.svg"


def _block_markdown(block: Block, column: str, figures: str | None) -> str:
    """Markdown text of one block; empty for a figure if `figures`, the link to their folder, is None."""
    match block:
        case Heading():
            return f"{'#' * block.level} {_escape(block.text)}"
        case Paragraph():
            words = _escape(block.text)
            return f"> **{words}**" if block.tone in ("good", "bad") else words
        case Bullets():
            return "\n".join(
                f"* {'**!** ' if block.tone == 'bad' else ''}{_escape(t)}" for t in block.texts
            )
        case Table():
            return _table_markdown(block)
        case Card():
            terms = "\n".join(f"* {_escape(name)}: {_escape(t)}" for name, t in block.terms)
            return f"**{_escape(block.title)}** — {_escape(block.text)}\n\n{terms}"
        case Picture():
            if figures is None:
                return ""
            link = f"{figures}/{_figure_file_name(column, block)}".replace(" ", "%20")
            return f"![{_escape(block.caption)}]({link})\n\n*{_escape(block.caption)}*"


def _table_markdown(table: Table) -> str:
    """Markdown text of a table; without a head, a list of terms."""
    if not table.head:
        return "\n".join(f"* {_escape(a)}: {_escape(b)}" for a, b in table.rows)
    rule = ["---:" if i in table.right else "---" for i in range(len(table.head))]
    rows = [
        [_escape(h) for h in table.head],
        rule,
        *([_escape(c) for c in r] for r in table.rows),
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _escape(words: str) -> str:
    """Text with Markdown's special characters escaped, on one line."""
    for sign in "\\`*_<>|[]#&$~":
        words = words.replace(sign, f"\\{sign}")
    return words.replace("\n", " ")

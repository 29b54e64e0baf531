"""Reports as Markdown, with figures in separate files."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from allanite import _kernels
from allanite.common.files import whole_file
from allanite.common.plain import file_name
from allanite.report.blocks import (
    Block,
    Bullets,
    Card,
    Cell,
    Heading,
    Number,
    Paragraph,
    Picture,
    Table,
)
from allanite.report.ending import column_blocks, method_section
from allanite.report.overview import overview_blocks
from allanite.report.summary import first_page_blocks, title_and_line

if TYPE_CHECKING:
    from allanite.report.document import Report


def markdown_text(report: Report, figures: str | None = None) -> str:
    """Markdown text of a report; `figures` is the folder of the figures, as a link."""
    one = len(report.entries) == 1
    title, line = title_and_line(report)
    out = [f"# {_escape(title)}", _escape(f"Noise report · {line} · allanite {_kernels.version()}")]
    out += [_block_markdown(block, "", figures) for block in first_page_blocks(report)]
    for name, blocks in _blocks_of_columns(report):
        if not one and name:
            out.append(f"## {_escape(name)}")
        out += [t for block in blocks if (t := _block_markdown(block, name, figures))]
    out += [_block_markdown(block, "", figures) for block in method_section(report)]
    return "\n\n".join(out) + "\n"


def write_figures(report: Report, folder: Path) -> None:
    """Write all figures of a report as SVG to a folder, which is created if needed.

    A new folder is removed again if a figure cannot be written.
    """
    from allanite.plots.matplotlib_painter import render

    new = not folder.exists()
    folder.mkdir(exist_ok=True)
    try:
        for name, blocks in [("", first_page_blocks(report)), *_blocks_of_columns(report)]:
            for block in blocks:
                if isinstance(block, Picture):
                    figure = replace(block.figure, title="", subtitle="")
                    content = render(figure, "svg", "light", (block.width, block.height))
                    with whole_file(folder / _figure_file_name(name, block)) as draft:
                        draft.write_bytes(content)
    except BaseException:
        if new:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def _blocks_of_columns(report: Report) -> list[tuple[str, list[Block]]]:
    """List of (name of a column, its blocks); blocks on all axes together, if any, come first with the name ""."""
    axes = report.axes if len(report.entries) > 1 else None
    first: list[tuple[str, list[Block]]] = [] if axes is None else [("", overview_blocks(axes))]
    names = [entry.recording.columns[0] for entry in report.entries]
    blocks = column_blocks(report.entries, [""] * len(names))
    return first + list(zip(names, blocks, strict=True))


def _figure_file_name(column: str, picture: Picture) -> str:
    """File name of a figure: ``column-name.svg``, or ``name.svg`` without a column."""
    return f"{file_name(column)}-{picture.name}.svg" if column else f"{picture.name}.svg"


def _block_markdown(block: Block, column: str, figures: str | None) -> str:
    """Markdown text of one block; empty for a figure if `figures`, the link to their folder, is None."""
    match block:
        case Heading():
            return f"{'#' * block.level} {_escape(block.text)}"
        case Paragraph():
            words = _cell_markdown(block.cell)
            return f"> **{words}**" if block.tone in ("good", "bad") else words
        case Bullets():
            return "\n".join(
                f"* {'**!** ' if block.tone == 'bad' else ''}{_cell_markdown(c)}"
                for c in block.cells
            )
        case Table():
            return _table_markdown(block)
        case Card():
            terms = "\n".join(f"* {_escape(name)}: {_cell_markdown(c)}" for name, c in block.terms)
            return f"**{_escape(block.title)}** — {_escape(block.text)}\n\n{terms}"
        case Picture():
            if figures is None:
                return ""
            link = f"{figures}/{_figure_file_name(column, block)}".replace(" ", "%20")
            return f"![{_escape(block.caption)}]({link})\n\n*{_escape(block.caption)}*"


def _table_markdown(table: Table) -> str:
    """Markdown text of a table; without a head, a list of terms."""
    if not table.head:
        return "\n".join(f"* {_cell_markdown(a)}: {_cell_markdown(b)}" for a, b in table.rows)
    rule = ["---:" if i in table.right else "---" for i in range(len(table.head))]
    rows = [
        [_escape(h) for h in table.head],
        rule,
        *([_cell_markdown(c) for c in r] for r in table.rows),
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _cell_markdown(cell: Cell) -> str:
    """Markdown text of a cell, escaped; parts of a tuple are joined, and a `Number` is its text."""
    if isinstance(cell, tuple):
        return "".join(_cell_markdown(part) for part in cell)
    return _escape(cell.text if isinstance(cell, Number) else cell)


def _escape(words: str) -> str:
    """Text with Markdown's special characters escaped, on one line."""
    for sign in "\\`*_<>|[]#&$~":
        words = words.replace(sign, f"\\{sign}")
    return words.replace("\n", " ")

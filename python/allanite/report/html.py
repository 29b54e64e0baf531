"""Reports as one self-contained HTML page without scripts, in light and dark colors, ready to print."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.plots.svg_painter import color_rules, inline_svg
from allanite.report.blocks import Block, Bullets, Card, Heading, Paragraph, Picture, Table
from allanite.report.content import column_title
from allanite.report.ending import report_sections
from allanite.report.summary import title_and_line

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.plots import Figure
    from allanite.report.document import Report

#: Style element with the print layout of a stand-alone page; omitted in a notebook, which has its own layout.
SHEETS = (
    "<style>@page { size: A4; margin: 15mm 14mm 16mm; @bottom-right { content: counter(page) ' / ' counter(pages); "
    "font: 8pt sans-serif; color: #666; } }</style>"
)
#: Content security policy: nothing is fetched, framed or sent, and only scripts with a listed digest run. Figures need
#: inline styles, and plotly saves pictures through data: and blob: addresses.
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'; "
    "script-src {scripts}"
)
#: Maximum width of a page, pixels.
WIDTH = 1000
#: JavaScript program that draws all figures of a page.
_DRAW = """
const dark = matchMedia('(prefers-color-scheme: dark)');
function draw() {
  for (const place of document.querySelectorAll('.plot')) {
    const figure = JSON.parse(document.getElementById(place.dataset.figure).textContent)[dark.matches ? 1 : 0];
    Plotly.react(place, figure.data, {...figure.layout, autosize: true}, {responsive: true, displaylogo: false});
  }
}
dark.addEventListener('change', draw);
draw();
"""


def html_page(report: Report, interactive: bool = False) -> str:
    """Text of the complete HTML page of a report; with `interactive`, with the scripts of plotly."""
    title = f"Noise report: {', '.join(column_title(e) for e in report.entries)}"
    plots = PlotlyFigures() if interactive else None
    content = _content_html(report, plots)
    scripts = "" if plots is None else plots.scripts()
    return html_skeleton(title, content, scripts, "'none'" if plots is None else plots.sources())


def html_skeleton(title: str, content: str, scripts: str = "", sources: str = "'none'") -> str:
    """Text of a complete HTML page in the style of reports around `content`. `sources`: digests of allowed scripts."""
    policy = POLICY.format(scripts=sources)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="generator" content="allanite {escape(_kernels.version())}">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n{_style_element()}\n{SHEETS}\n</head>\n"
        f'<body class="allanite">\n<main>\n{content}\n</main>\n{scripts}</body>\n</html>\n'
    )


def blocks_html(blocks: Sequence[Block]) -> str:
    """HTML text of some blocks, one after the other, with static figures."""
    return "\n".join(_block_html(block, None) for block in blocks)


def html_fragment(report: Report) -> str:
    """HTML text of a report for embedding in another page, such as a notebook, with its style element."""
    return (
        f'{_style_element()}<div class="allanite"><main>{_content_html(report, None)}</main></div>'
    )


def _style_element() -> str:
    """HTML text of the style element of reports."""
    own = files(__package__).joinpath("style.css").read_text("utf-8")
    return f"<style>\n{own}{color_rules()}\n</style>"


def _content_html(report: Report, plots: PlotlyFigures | None) -> str:
    """HTML text of all sections of a report; with `plots`, figures are interactive and are added to `plots`."""
    several = len(report.entries) > 1
    title, line = title_and_line(report)
    line += f" · allanite {_kernels.version()}"
    line = _with_unbroken_units(escape(line))
    out = [f"<header>\n<h1>{escape(title)}</h1>\n<p>Noise report · {line}</p>\n</header>"]
    column = 0
    for place, (name, blocks) in enumerate(report_sections(report)):
        if several and name:
            out.append(f'<h2 id="column-{column}">{escape(name)}</h2>')
            column += 1
        out += [_block_html(block, plots) for block in blocks]
        if several and place == 0:
            items = "".join(
                f'<li><a href="#column-{i}">{escape(e.recording.columns[0])}</a>: {escape(e.study.fit.model.name)}</li>'
                for i, e in enumerate(report.entries)
            )
            out.append(f"<nav><ol>{items}</ol></nav>")
    return "\n".join(out)


def _block_html(block: Block, plots: PlotlyFigures | None) -> str:
    """HTML text of one block; with `plots`, a figure is interactive and is added to `plots`."""
    match block:
        case Heading():
            text = f"<h{block.level}>{escape(block.text)}</h{block.level}>"
        case Paragraph():
            kind = {"good": "verdict good", "bad": "verdict bad"}.get(block.tone, block.tone)
            attribute = "" if kind == "plain" else f' class="{kind}"'
            text = f"<p{attribute}>{escape(block.text)}</p>"
        case Bullets():
            attribute = "" if block.tone == "plain" else f' class="{block.tone}"'
            items = "".join(f"<li>{escape(t)}</li>" for t in block.texts)
            text = f"<ul{attribute}>{items}</ul>"
        case Table():
            text = _table_html(block)
        case Card():
            terms = "".join(
                f"<tr><th>{escape(n)}</th><td>{escape(t)}</td></tr>" for n, t in block.terms
            )
            text = (
                f'<section class="card"><h5>{escape(block.title)}</h5><p>{escape(block.text)}</p>'
                f'<table class="terms"><tbody>{terms}</tbody></table></section>'
            )
        case Picture():
            if plots is not None:
                drawing = plots.add(block.figure, block.height / block.width)
            else:
                size = (block.width, block.height)
                drawing = inline_svg(block.figure, size, escape(block.caption, True))
            caption = _with_unbroken_units(escape(block.caption))
            return f"<figure>{drawing}<figcaption>{caption}</figcaption></figure>"
    return _with_unbroken_units(text)


#: Regular expression of the begin of a unit. A line of text may not break between a number and such a unit; the page has
#: the same expression in `page/static/core.js`.
UNITS = r"[°µ%σ√]|\(°|(?:s|ms|ns|min|h|d|Hz|kHz|MHz|rad|mrad|g|mg|m|K|ppm|nats|dB|MB|GB)\b"
_GAP = re.compile(f"([0-9⁰¹²³⁴⁵⁶⁷⁸⁹]) (?={UNITS})", re.ASCII)


def _with_unbroken_units(html: str) -> str:
    """Copy of an HTML text with a no-break space between each number and its unit."""
    return _GAP.sub("\\1\N{NO-BREAK SPACE}", html)


def _table_html(table: Table) -> str:
    """HTML text of a table in a scrollable container; a table without a head has names in its first column."""

    def row(cells: tuple[str, ...]) -> str:
        """HTML text of one row of the table; without a head, the first cell is a name and only two cells are used."""
        inside = [escape(c) for c in cells]
        if not table.head:
            return f"<tr><th>{inside[0]}</th><td>{inside[1]}</td></tr>"
        return (
            "<tr>"
            + "".join(f"<td{_alignment(i, table)}>{text}</td>" for i, text in enumerate(inside))
            + "</tr>"
        )

    head = "".join(f"<th{_alignment(i, table)}>{escape(h)}</th>" for i, h in enumerate(table.head))
    head = f"<thead><tr>{head}</tr></thead>" if head else ""
    kinds = " ".join((["terms"] if not table.head else []) + (["small"] if table.small else []))
    attribute = f' class="{kinds}"' if kinds else ""
    rows = "".join(row(r) for r in table.rows)
    return f'<div class="wide"><table{attribute}>{head}<tbody>{rows}</tbody></table></div>'


def _alignment(column: int, table: Table) -> str:
    """Text of the HTML attribute that right-aligns a column of a table; empty for a left-aligned column."""
    return ' class="r"' if column in table.right else ""


class PlotlyFigures:
    """Collects the interactive figures of an HTML page: `add` each figure, then append `scripts` to the page."""

    def __init__(self) -> None:
        self.documents: list[str] = []

    def add(self, figure: Figure, shape: float) -> str:
        """HTML element that shows a figure, which is stored for `scripts`; `shape` is the ratio of height to width."""
        both = [_without_size(figure.to_plotly(theme)) for theme in ("light", "dark")]
        text = json.dumps(both, allow_nan=False).replace("<", "\\u003c")
        name = f"figure-{len(self.documents)}"
        self.documents.append(f'<script type="application/json" id="{name}">{text}</script>')
        pixels = round(max(shape, 0.4) * WIDTH * 1.1)
        return f'<div class="plot" data-figure="{name}" style="height: {pixels}px"></div>'

    def scripts(self) -> str:
        """HTML text of the script elements: plotly, the stored figures, and the program that draws them."""
        library, draw = (f"<script>{text}</script>" for text in _script_sources())
        return "\n".join([library, *self.documents, f"{draw}\n"])

    def sources(self) -> str:
        """Text with the digests of the two programs in `scripts`, as sources for a content security policy."""
        return " ".join(f"'sha256-{_base64_digest(text)}'" for text in _script_sources())


def _script_sources() -> tuple[str, str]:
    """(source of plotly, source of the drawing program); lines end in a newline, as browsers read them.

    Digests of these texts therefore equal those that a browser computes.
    """
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).replace("\r\n", "\n").replace("\r", "\n"), _DRAW


def _base64_digest(text: str) -> str:
    """SHA-256 digest of a text (UTF-8) in base64."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _without_size(document: dict[str, Any]) -> dict[str, Any]:
    """Copy of a plotly document without size and title and with a top margin of 44 px: the figure fills its container."""
    layout = {k: v for k, v in document["layout"].items() if k not in ("width", "height", "title")}
    layout["margin"] = {**layout.get("margin", {}), "t": 44}
    return {"data": document["data"], "layout": layout}

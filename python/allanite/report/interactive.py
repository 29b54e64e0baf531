"""Interactive figures of a report: plotly, embedded once, and each figure in the light and the dark theme."""

from __future__ import annotations

import base64
import hashlib
import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from allanite.plots import Figure

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

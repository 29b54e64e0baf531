"""Interactive figures of a report: plotly, embedded once, and each figure in the light and the dark theme."""

from __future__ import annotations

import base64
import hashlib
import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from allanite.plots import Figure

#: Maximum width of a page in pixels.
WIDTH = 1000

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
    """Collector of the figures of a page while the page is written."""

    def __init__(self) -> None:
        self.documents: list[str] = []

    def place(self, figure: Figure, shape: float) -> str:
        """HTML element that shows a figure; `shape` is the ratio of its height to its width."""
        both = [_sized(figure.to_plotly(theme)) for theme in ("light", "dark")]
        text = json.dumps(both, allow_nan=False).replace("<", "\\u003c")
        name = f"figure-{len(self.documents)}"
        self.documents.append(f'<script type="application/json" id="{name}">{text}</script>')
        pixels = round(max(shape, 0.4) * WIDTH * 1.1)
        return f'<div class="plot" data-figure="{name}" style="height: {pixels}px"></div>'

    def scripts(self) -> str:
        """Script elements: plotly, the figures, and the program that draws them."""
        library, draw = (f"<script>{text}</script>" for text in _programs())
        return "\n".join([library, *self.documents, f"{draw}\n"])

    def sources(self) -> str:
        """Digests of the two programs of `scripts`, as sources for a content security policy."""
        return " ".join(f"'sha256-{_digest(text)}'" for text in _programs())


def _programs() -> tuple[str, str]:
    """Pair: source of plotly and of the drawing program, with the line ends that browsers use to compute digests."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).replace("\r\n", "\n").replace("\r", "\n"), _DRAW


def _digest(text: str) -> str:
    """SHA-256 digest in base64."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _sized(document: dict[str, Any]) -> dict[str, Any]:
    """Dict: figure without a fixed size, title, and title margin, so that it fills its container."""
    layout = {k: v for k, v in document["layout"].items() if k not in ("width", "height", "title")}
    layout["margin"] = {**layout.get("margin", {}), "t": 44}
    return {"data": document["data"], "layout": layout}

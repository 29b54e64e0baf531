"""A figure as SVG inside a page: both themes in one drawing, names that do not meet those of other figures."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from allanite.plots.themes import Theme, theme_of

if TYPE_CHECKING:
    from allanite.plots.spec import Figure

__all__ = ["inline"]

_COLOR = re.compile(r"(fill|stroke|stop-color): (#[0-9a-f]{6})")
_NAME = re.compile(r'(\bid="|href="#|url\(#)([^")]+)')


def inline(figure: Figure, size: tuple[float, float], prefix: str, label: str) -> str:
    """The ``<svg>`` element of a figure of `size` inches, which the page scales; ids begin with `prefix`.

    Every colour is written twice, plain and as CSS ``light-dark()``: where a browser does not know the latter, or on
    paper, the light one holds.
    """
    from allanite.plots.matplotlib_painter import render

    text = render(figure, "svg", "light", size).decode("utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    head, rest = text.split(">", 1)
    head = re.sub(r'\s(width|height|xmlns:xlink)="[^"]*"', "", head)
    rest = rest.replace("xlink:href", "href")
    names: dict[str, str] = {}

    def rename(match: re.Match[str]) -> str:
        name = names.setdefault(match[2], f"{prefix}{len(names)}")
        return match[1] + name

    rest = _NAME.sub(rename, rest)
    rest = _COLOR.sub(lambda m: f"{m[1]}: {m[2]}; {m[1]}: light-dark({m[2]}, {_dark(m[2])})", rest)
    rest = re.sub(r"\n\s*", "\n", rest).strip()
    return f'{head} role="img" aria-label="{label}">{rest}'


@lru_cache(maxsize=4096)
def _dark(color: str) -> str:
    """The dark theme's colour for one of the light theme's, shades of the map of ratios included."""
    light, dark = theme_of("light"), theme_of("dark")
    known = _table(light, dark)
    return known[color] if color in known else _shade(color, light, dark)


def _table(light: Theme, dark: Theme) -> dict[str, str]:
    pairs = {light.roles[role]: dark.roles[role] for role in light.roles}
    pairs |= {light.text: dark.text, light.faint: dark.faint, light.grid: dark.grid}
    pairs |= {light.panel: dark.panel, "#000000": dark.text}
    pairs |= dict(zip(light.diverging, dark.diverging, strict=True))
    # A role's colour wins over the same colour at an end of the map.
    pairs |= {light.roles[role]: dark.roles[role] for role in light.roles}
    return {a.lower(): b for a, b in pairs.items()}


def _shade(color: str, light: Theme, dark: Theme) -> str:
    """The place of a colour between the ends and the middle of the light map, on the dark one."""
    here = _rgb(color)
    best = (np.inf, 0.0, 0)
    low, middle, high = (_rgb(c) for c in light.diverging)
    for side, end in enumerate((low, high)):
        along = end - middle
        part = float(np.clip((here - middle) @ along / (along @ along), 0.0, 1.0))
        off = float(np.abs(middle + part * along - here).sum())
        best = min(best, (off, part, side))
    _, part, side = best
    known = _table(light, dark)
    ends = [_rgb(known[light.diverging[i].lower()]) for i in (0, 2)]
    centre = _rgb(dark.diverging[1])
    red, green, blue = (round(float(v)) for v in centre + part * (ends[side] - centre))
    return f"#{red:02x}{green:02x}{blue:02x}"


def _rgb(color: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float64)

"""Figures as compact SVG inside a page, in the page's light and dark colors.

Every mark has the class of its role, whose color the style sheet defines (`color_rules`). One inch is 100 pixels.
"""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from allanite.plots.spec import (
    Axis,
    Band,
    Bars,
    Figure,
    HeatMap,
    Line,
    Mark,
    Note,
    Panel,
    Points,
    Rule,
    Span,
    label_of,
    text_anchor,
)
from allanite.plots.themes import theme_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    #: Box (left, top, width, height), pixels.
    _Box = tuple[int, int, int, int]

#: Average width of a letter of the labels, and distance of text lines, pixels.
LETTER, LINE = 6.3, 14
#: Margins, pixels: left of a panel, above a panel without and with a title, and below a panel with an x axis.
LEFT, GAP, TITLE, BELOW = 66, 14, 24, 42
#: Margin right of a map for its color bar, pixels.
BAR = 84
#: Dash style of a mark → SVG attribute.
DASHES = {"solid": "", "dash": ' stroke-dasharray="6 4"', "dot": ' stroke-dasharray="1.5 3"'}
#: Maximum distance, pixels, between a simplified line and the points that it omits.
FLAT = 0.2
#: Number of shades in each half of the color scale of a map.
SHADES = 12
#: Alignment of a text → value of SVG's text-anchor.
ANCHORS = {"left": "start", "center": "middle", "right": "end"}


def color_rules() -> str:
    """CSS text: rules that define the color of every role for the light and the dark theme."""
    light, dark = theme_of("light"), theme_of("dark")
    roles = (*light.roles, "faint", "grid", "text", "panel")
    pairs = {role: (light.color(role), dark.color(role)) for role in roles}
    pairs |= {
        "low": (light.diverging[0], dark.diverging[0]),
        "high": (light.diverging[2], dark.diverging[2]),
    }
    return "\n".join(
        f".allanite .k-{role} {{ color: {a}; color: light-dark({a}, {b}); }}"
        for role, (a, b) in pairs.items()
    )


def inline_svg(figure: Figure, size: tuple[float, float], label: str) -> str:
    """Text of an ``<svg>`` element that draws a figure of `size` inches (100 pixels each); `label` describes it."""
    width, height = (100.0 * inches for inches in size)
    legend, used = _legend_elements(figure, width)
    parts = []
    for panel, box in _panel_boxes(figure, width, height - used):
        parts.append(_panel_elements(panel, *box))
    parts.append(f'<g transform="translate(0 {height - used:.0f})">{legend}</g>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{label}" '
        f'class="k-text" font-size="11" fill="currentColor">{"".join(parts)}</svg>'
    )


def _left_width(panel: Panel) -> float:
    """Estimated width in pixels of the space left of a panel, for the tick texts and the label of its y axis."""
    texts = [line for _, text in panel.y.ticks for line in text.split("\n")]
    longest = max(map(len, texts), default=0) if panel.show_y else 0
    return max(LEFT if panel.y.label else 0.0, 10 + LETTER * longest) if panel.show_y else 12.0


def _panel_boxes(
    figure: Figure, width: float, height: float
) -> list[tuple[Panel, tuple[float, float, float, float]]]:
    """(panel, (left, top, width, height) in pixels), in the order of the figure's panels."""
    columns, rows = len(figure.widths), len(figure.heights)
    left = [
        max((_left_width(p) for p in figure.panels if p.column == i), default=0)
        for i in range(columns)
    ]
    right = [
        BAR if any(p.find(HeatMap) for p in figure.panels if p.column == i) else 14
        for i in range(columns)
    ]
    top = [
        max((TITLE if p.title else GAP for p in figure.panels if p.row == i), default=0)
        for i in range(rows)
    ]
    below = [
        max((BELOW if p.show_x else 0 for p in figure.panels if p.row + p.rows - 1 == i), default=0)
        for i in range(rows)
    ]
    across = (width - sum(left) - sum(right)) / sum(figure.widths)
    down = (height - sum(top) - sum(below)) / sum(figure.heights)
    x = [
        sum(left[: i + 1]) + sum(right[:i]) + across * sum(figure.widths[:i])
        for i in range(columns)
    ]
    y = [sum(top[: i + 1]) + sum(below[:i]) + down * sum(figure.heights[:i]) for i in range(rows)]
    out = []
    for p in figure.panels:
        last = p.row + p.rows - 1
        end = y[last] + down * figure.heights[last]
        out.append((p, (x[p.column], y[p.row], across * figure.widths[p.column], end - y[p.row])))
    return out


class _Scale:
    """Callable that converts values of an axis (array or float) to pixels, an array of the same shape."""

    def __init__(self, axis: Axis, size: float, upright: bool) -> None:
        self.log, self.size = axis.log, size
        ends = (axis.low, axis.high)
        self.low, self.high = (math.log10(v) for v in ends) if axis.log else ends
        self.flip = upright != axis.reverse

    def __call__(self, values: float | Array) -> Array:
        v = np.asarray(values, dtype=float)
        if self.log:
            v = np.log10(np.maximum(v, 1e-300))
        part = (v - self.low) / (self.high - self.low)
        # Values far outside the axis would only produce long numbers.
        part = np.clip(part, -3.0, 4.0)
        return self.size * (1.0 - part if self.flip else part)


def _px(value: float) -> str:
    """Text of a coordinate in pixels with one decimal, without a trailing ``.0``."""
    return f"{value:.1f}".removesuffix(".0")


def _text_element(x: float, y: float, words: str, anchor: str = "start", more: str = "") -> str:
    """SVG text element at (x, y) in pixels; `more` are further attributes."""
    side = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{_px(x)}" y="{_px(y)}"{side}{more}>{escape(words, quote=False)}</text>'


def _panel_elements(panel: Panel, left: float, top: float, width: float, height: float) -> str:
    """Text of the SVG elements of one panel: grid, marks, axes and color bar."""
    x, y = _Scale(panel.x, width, upright=False), _Scale(panel.y, height, upright=True)
    grid = _grid_path(panel, x, y, width, height)
    marks = "".join(
        _mark_elements(mark, x, y, width, height)
        for mark in sorted(panel.marks, key=_drawing_order)
    )
    return (
        f'<g transform="translate({_px(left)} {_px(top)})">{grid}'
        f'<svg width="{_px(width)}" height="{_px(height)}">{marks}</svg>'
        f'<path class="k-faint" stroke="currentColor" fill="none" d="M0 0V{_px(height)}H{_px(width)}"/>'
        f"{_axis_elements(panel, x, y, width, height)}{_color_bar_elements(panel, width, height)}</g>"
    )


def _grid_path(panel: Panel, x: _Scale, y: _Scale, width: float, height: float) -> str:
    """Text of the SVG path of the grid lines; empty if the panel has no grid."""
    if not panel.grid:
        return ""
    lines = [f"M{_px(float(x(v)))} 0V{_px(height)}" for v, _ in panel.x.ticks]
    if not panel.find(Bars):
        lines += [f"M0 {_px(float(y(v)))}H{_px(width)}" for v, _ in panel.y.ticks]
    return f'<path class="k-grid" stroke="currentColor" fill="none" d="{"".join(lines)}"/>'


def _axis_elements(panel: Panel, x: _Scale, y: _Scale, width: float, height: float) -> str:
    """SVG elements of the ticks, tick texts, axis labels and title of a panel."""
    out = []
    ticks = "".join(f"M{_px(float(x(v)))} {_px(height)}v4" for v, _ in panel.x.ticks)
    if not panel.find(Bars):
        ticks += "".join(f"M0 {_px(float(y(v)))}h-4" for v, _ in panel.y.ticks)
    out.append(f'<path class="k-faint" stroke="currentColor" fill="none" d="{ticks}"/>')
    if panel.show_x:
        out += [
            _text_element(float(x(v)), height + 17, text, "middle") for v, text in panel.x.ticks
        ]
        out.append(
            _text_element(width / 2, height + 35, panel.x.label, "middle", ' font-size="12"')
        )
    if panel.show_y:
        for v, text in panel.y.ticks:
            lines = text.split("\n")
            start = float(y(v)) + 4 - LINE * (len(lines) - 1) / 2
            out += [
                _text_element(-7, start + LINE * i, line, "end") for i, line in enumerate(lines)
            ]
        if panel.y.label:
            turn = f' font-size="12" transform="translate({_px(14 - _left_width(panel))} {_px(height / 2)}) rotate(-90)"'
            out.append(_text_element(0, 0, panel.y.label, "middle", turn))
    if panel.title:
        out.append(_text_element(0, -8, panel.title, more=' font-size="13" font-weight="600"'))
    return "".join(out)


def _color_bar_elements(panel: Panel, width: float, height: float) -> str:
    """Text of the SVG elements of the color bar of a map; empty without a map."""
    found = panel.find(HeatMap)
    if not found:
        return ""
    heat: HeatMap = found[0]
    scale = _Scale(Axis("", -heat.limit, heat.limit), height, upright=True)
    out, step = [], 2.0 * heat.limit / (2 * SHADES)
    for i in range(2 * SHADES):
        value = -heat.limit + (i + 0.5) * step
        top = float(scale(value + step / 2))
        role, shade = ("low", -value) if value < 0 else ("high", value)
        out.append(
            f'<rect class="k-{role}" x="{_px(width + 12)}" y="{_px(top)}" width="12" '
            f'height="{_px(height / (2 * SHADES) + 0.3)}" fill="currentColor" fill-opacity="{shade / heat.limit:.2f}"/>'
        )
    out += [_text_element(width + 29, float(scale(v)) + 4, text) for v, text in heat.ticks]
    turn = f' transform="translate({_px(width + BAR - 6)} {_px(height / 2)}) rotate(-90)"'
    return "".join(out) + _text_element(0, 0, heat.label, "middle", turn)


def _drawing_order(mark: Mark) -> int:
    """Integer sort key of a mark: marks with lower keys are drawn first, so that points lie above lines and areas."""
    order = (HeatMap, Span, Band, Rule, Line, Bars, Points, Note)
    return next(i for i, kind in enumerate(order) if isinstance(mark, kind))


def _mark_elements(mark: Mark, x: _Scale, y: _Scale, width: float, height: float) -> str:
    """Text of the SVG elements of one mark of any kind, in a panel of `width` × `height` pixels."""
    match mark:
        case Line():
            return _stroked_path(
                mark.color,
                path_data(*_simplified_line(x(mark.x), y(mark.y))),
                mark.width,
                mark.dash,
            )
        case Points():
            return _point_elements(mark, x, y)
        case Band():
            fill = f'fill="currentColor" fill-opacity="{mark.opacity:g}"'
            return f'<path class="k-{mark.color}" {fill} d="{_band_path_data(mark, x, y)}"/>'
        case Span():
            return _span_elements(mark, x, width, height)
        case Rule():
            at = float((x if mark.axis == "x" else y)(mark.value))
            path = (
                f"M{_px(at)} 0V{_px(height)}" if mark.axis == "x" else f"M0 {_px(at)}H{_px(width)}"
            )
            return _stroked_path(mark.color, path, mark.width, mark.dash)
        case Bars():
            return _bar_elements(mark, x, y)
        case HeatMap():
            return _heat_map_elements(mark, x, y)
        case Note():
            more = f' font-size="12" class="k-{mark.color}"'
            return _text_element(mark.x * width, (1 - mark.y) * height, mark.text, "middle", more)


def _stroked_path(role: str, path: str, width: float, dash: str = "solid", more: str = "") -> str:
    """Text of an SVG path element that strokes `path` in the color of a role; `more` are further attributes."""
    style = f'stroke="currentColor" stroke-width="{width:g}" fill="none"{DASHES[dash]}{more}'
    return f'<path class="k-{role}" {style} d="{path}"/>'


def _simplified_line(x: Array, y: Array) -> tuple[Array, Array]:
    """(x, y) of a line with fewer points; no omitted point is over 0.2 pixels away from the new line.

    Ramer 1972; Douglas and Peucker 1973. A line with values that are not finite is returned unchanged.
    """
    if x.size < 3 or not (np.isfinite(x).all() and np.isfinite(y).all()):
        return x, y
    kept = np.zeros(x.size, dtype=bool)
    kept[[0, -1]] = True
    open_ = [(0, x.size - 1)]
    while open_:
        first, last = open_.pop()
        if last - first < 2:
            continue
        inside = slice(first + 1, last)
        dx, dy = x[last] - x[first], y[last] - y[first]
        apart = np.abs(dx * (y[inside] - y[first]) - dy * (x[inside] - x[first]))
        apart /= max(math.hypot(dx, dy), 1e-9)
        top = int(apart.argmax())
        if apart[top] > FLAT:
            middle = first + 1 + top
            kept[middle] = True
            open_ += [(first, middle), (middle, last)]
    return x[kept], y[kept]


def path_data(x: Array, y: Array, unit: float = 0.1) -> str:
    """Attribute d of an SVG path through points rounded to `unit` pixels, with gaps at non-finite points."""
    out: list[str] = []
    last = None
    for a, b in zip(x, y, strict=True):
        if not (math.isfinite(a) and math.isfinite(b)):
            last = None
            continue
        here = round(a / unit), round(b / unit)
        if last is None:
            out.append(f"M{_px(here[0] * unit)} {_px(here[1] * unit)}l")
        elif here != last:
            steps = (f"{unit * (p - q):.1f}" for p, q in zip(here, last, strict=True))
            out += [s if s[0] == "-" else f" {s}" for s in map(_short_number, steps)]
        last = here
    return "".join(out).replace("l ", "l").removesuffix("l")


def _short_number(text: str) -> str:
    """Text of a number with one decimal without needless zeros: 0.5 as .5, -0.5 as -.5 and 2.0 as 2; 10.5 remains."""
    sign, size = ("-", text[1:]) if text[0] == "-" else ("", text)
    return sign + size.removesuffix(".0") if size.endswith(".0") else sign + size.removeprefix("0")


def _band_path_data(band: Band, x: _Scale, y: _Scale) -> str:
    """Text for the attribute d of an SVG path around a band, one closed polygon per gap-free range."""
    out = []
    for piece in band.gap_free_ranges():
        across = x(band.x[piece])
        top, bottom = (_simplified_line(across, y(edge[piece])) for edge in (band.high, band.low))
        around = [np.concatenate([a, b[::-1]]) for a, b in zip(top, bottom, strict=True)]
        path = path_data(around[0], around[1], 0.5)
        out.append(f"{path}Z")
    return "".join(out)


def _point_elements(mark: Points, x: _Scale, y: _Scale) -> str:
    """Text of the SVG elements of markers with their error bars; points and bars with non-finite values are left out."""
    a, b = x(mark.x), y(mark.y)
    kept = np.isfinite(a) & np.isfinite(b) & np.isfinite(mark.y)
    out = ""
    if mark.low is not None and mark.high is not None:
        known = kept & np.isfinite(mark.low) & np.isfinite(mark.high)
        ends = zip(a[known], y(mark.low[known]), y(mark.high[known]), strict=True)
        path = "".join(f"M{_px(p)} {_px(q)}V{_px(r)}" for p, q, r in ends)
        out = _stroked_path(mark.color, path, 0.9, more=' stroke-opacity=".75"')
    dots = "".join(f"M{_px(p)} {_px(q)}h0" for p, q in zip(a[kept], b[kept], strict=True))
    size, cap = 1.4 * mark.size, ' stroke-linecap="round"'
    out += _stroked_path(mark.color, dots, size, more=cap)
    return out + (_stroked_path("panel", dots, size - 1.8, more=cap) if mark.hollow else "")


def _span_elements(mark: Span, x: _Scale, width: float, height: float) -> str:
    """Text of the SVG elements of a shaded range, at least one pixel wide, with its text at the top if it has one."""
    low, high = sorted(float(x(v)) for v in (mark.low, mark.high))
    out = (
        f'<rect class="k-{mark.color}" x="{_px(low)}" width="{_px(max(high - low, 1.0))}" height="{_px(height)}" '
        'fill="currentColor" fill-opacity=".25" stroke="currentColor"/>'
    )
    if not mark.text:
        return out
    middle = 0.5 * (max(low, 0.0) + min(high, width))
    place, side = text_anchor(middle / width, LETTER * len(mark.text) / width)
    more = ' font-weight="600"'
    return out + _text_element(place * width, 13, mark.text, ANCHORS[side], more)


def _bar_elements(mark: Bars, x: _Scale, y: _Scale) -> str:
    """Text of the SVG elements of horizontal bars from 0 with their texts; bars without a value have no length."""
    out, zero = [], float(x(0.0))
    half = abs(float(y(1.0)) - float(y(0.0))) / 4
    for i, (value, text, role) in enumerate(
        zip(np.nan_to_num(mark.values), mark.texts, mark.colors, strict=True)
    ):
        end, at = float(x(value)), float(y(float(i)))
        out.append(
            f'<rect class="k-{role}" x="{_px(min(zero, end))}" y="{_px(at - half)}" width="{_px(abs(end - zero))}" '
            f'height="{_px(2 * half)}" fill="currentColor"/>'
        )
        out.append(_text_element(end + 5, at + 4, text))
    return "".join(out)


def _heat_map_elements(mark: HeatMap, x: _Scale, y: _Scale) -> str:
    """SVG elements of the cells of a map, one path per shade, and of frames around marked cells."""
    across, down = x(mark.x_edges), y(mark.y_edges)
    shades: dict[tuple[str, int], list[_Box]] = {}
    frames = []
    for (row, column), value in np.ndenumerate(mark.values):
        left, right = (round(v) for v in across[column : column + 2].tolist())
        high, low = sorted(round(v) for v in down[row : row + 2].tolist())
        cell = left, high, right - left, low - high
        if math.isfinite(value):
            shade = round(SHADES * min(abs(value) / mark.limit, 1.0))
            if shade:  # a transparent cell needs no path
                shades.setdefault(("low" if value < 0 else "high", shade), []).append(cell)
        else:
            shades.setdefault(("grid", SHADES), []).append(cell)
        if mark.marked[row, column]:
            frames.append(cell)
    out = "".join(
        f'<path class="k-{role}" fill="currentColor" fill-opacity="{shade / SHADES:.2f}" d="{_boxes_path(cells)}"/>'
        for (role, shade), cells in shades.items()
    )
    return out + (_stroked_path("text", _boxes_path(frames), 1.0) if frames else "")


def _boxes_path(boxes: Sequence[_Box]) -> str:
    """Text for the attribute d of an SVG path around boxes; relative coordinates keep the text short."""
    out, x, y = ["M0 0"], 0, 0
    for left, top, width, height in boxes:
        out.append(f"m{left - x} {top - y}h{width}v{height}h{-width}z")
        x, y = left, top
    return "".join(out)


def _legend_elements(figure: Figure, width: float) -> tuple[str, float]:
    """Tuple (text of the SVG elements of the legend of all panels, wrapped to `width` pixels; its height in pixels)."""
    out, x, y = [], 14.0, 14.0
    for mark in figure.legend():
        label = label_of(mark)
        size = 36 + LETTER * len(label)
        if x > 14.0 and x + size > width:
            x, y = 14.0, y + 18.0
        out.append(
            f'<g transform="translate({_px(x)} {_px(y)})">{_legend_symbol_element(mark)}{_text_element(24, 4, label)}</g>'
        )
        x += size + 8
    return "".join(out), y + 12 if out else 4.0


def _legend_symbol_element(mark: Mark) -> str:
    """Text of the SVG elements of a mark's symbol in the legend: a square, a dot, or a stroke for lines and rules."""
    if isinstance(mark, Band | Span):
        opacity = mark.opacity if isinstance(mark, Band) else 0.25
        fill = f'fill="currentColor" fill-opacity="{opacity:g}"'
        return f'<rect class="k-{mark.color}" y="-5" width="18" height="10" {fill}/>'
    if isinstance(mark, Points):
        dot = _stroked_path(mark.color, "M9 0h0", 7, more=' stroke-linecap="round"')
        return dot + (
            _stroked_path("panel", "M9 0h0", 4, more=' stroke-linecap="round"')
            if mark.hollow
            else ""
        )
    assert isinstance(mark, Line | Rule)
    return _stroked_path(mark.color, "M0 0h18", mark.width, mark.dash)

"""Drawing of figures as SVG, PNG and PDF by matplotlib, without pyplot and without changing global settings."""

from __future__ import annotations

import io
import itertools
import re
import sys
import textwrap
import warnings
from contextlib import chdir, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.common.files import check_target, exists, whole_file
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
from allanite.plots.themes import Theme, theme_of

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Formats that can be written.
SUFFIXES = ("svg", "png", "pdf")
#: Default width and height, inches, and pixels per inch.
WIDTH, HEIGHT, DPI = 12.8, 7.2, 100
#: Heights of the title and of a line of the subtitle, in inches.
TITLE, LINE_HEIGHT = 0.29, 0.22
#: Sizes of the title and of a table in points, and the size of the title relative to other letters in a style.
TITLE_POINTS, TABLE_POINTS, TITLE_GROWTH = 13.0, 9.5, 1.25
#: Height of a row of a legend, in inches, and distance of the lines of a table, in sizes of its letters.
ROW, TABLE_SPACING = 0.185, 1.3
#: Width of a legend on a figure of `WIDTH`, and of the symbol before each label, in letters.
LETTERS, KEY = 177, 9
#: Width of a bold letter of the title and of a letter of a table, relative to their size (measured in DejaVu Sans).
BOLD_LETTER, MONO_LETTER = 0.68, 0.602
#: Share of the width of a grid column that the axes have, beside the texts of the y axis (measured: 0.81 to 0.9).
AXES_SHARE = 0.85
#: Fonts of tables and of all other texts.
MONO = "DejaVu Sans Mono"
FONT = "DejaVu Sans"  # included in matplotlib; contains all characters that are used
#: Texts are literal: a dollar sign does not start a formula.
TEXT: dict[str, Any] = {"family": FONT, "parse_math": False}
#: Dash style of a mark → line style of matplotlib.
DASHES: dict[str, Any] = {"solid": "-", "dash": (0, (5, 2.5)), "dot": (0, (1.2, 2))}
#: Drawing order (zorder) of shaded ranges, areas, guide lines, lines, points and texts.
BELOW, AREA, GUIDE, LINE, POINT, WORDS = 0.5, 1.0, 1.5, 2.5, 3.0, 4.0


@dataclass(frozen=True, slots=True)
class Style:
    """Layout of a figure for a medium, in inches and points.

    With `column`, all panels are below each other, without title and subtitle, and `height` is that of a row of panels
    with unit height. `points` is the size of all letters, None for those on the screen; `strokes` are widths of lines
    and sizes of points relative to the screen. `brief` omits the table, and labels a strip of residuals by its unit
    alone. `bars` is the maximum number of panels with bars: curves need the space in a column or on a slide. `dpi` is
    that of a PNG.
    """

    width: float = WIDTH
    height: float = HEIGHT
    column: bool = False
    points: float | None = None
    strokes: float = 1.0
    brief: bool = False
    bars: int | None = None
    dpi: int = DPI


#: Styles: screen, one column of a journal (88 mm, 8 pt), and slides (16:9).
STYLES = {
    "screen": Style(),
    "paper": Style(88.0 / 25.4, 1.8, True, 8.0, 0.6, bars=0, dpi=300),
    "slides": Style(16.0, 9.0, False, 18.0, 1.8, True, bars=1),
}


def save(figure: Figure, path: str | Path, theme: str = "light", style: str = "screen") -> None:
    """Write a figure to a file; an existing file is replaced only after the new file is complete.

    `path` ends in .svg, .png or .pdf. `style` is screen, paper or slides. Raises `InputError` for others, for a folder
    that does not exist, and without matplotlib.
    """
    target = Path(path)
    kind = target.suffix.lower().removeprefix(".")
    if kind not in SUFFIXES:
        raise InputError(f"{target}: a figure's name must end in .svg, .png or .pdf")
    check_target(target)
    content = render(figure, kind, theme, style=style)
    with whole_file(target) as draft:
        draft.write_bytes(content)


def render(
    figure: Figure,
    kind: str,
    theme: str = "light",
    size: tuple[float, float] | None = None,
    style: str = "screen",
) -> bytes:
    """Bytes of a figure as SVG, PNG or PDF (`kind`); `size` in inches, None for that of the style."""
    canvas = draw(figure, theme, size, style)
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    with warnings.catch_warnings():
        # Names may contain letters that the font lacks.
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        canvas.savefig(
            stream,
            format=kind,
            dpi=STYLES[style].dpi,
            facecolor=canvas.get_facecolor(),
            metadata=metadata,
        )
    return stream.getvalue()


def draw(
    figure: Figure,
    theme: str = "light",
    size: tuple[float, float] | None = None,
    style: str = "screen",
) -> Any:
    """``matplotlib.figure.Figure`` of a figure; `size` in inches, None for that of the style.

    Raises `InputError` for an unknown theme or style, or if matplotlib is not installed.
    """
    if style not in STYLES:
        raise InputError(f"unknown style {style!r}: {', '.join(STYLES)}")
    form = STYLES[style]
    if form.bars is not None:
        figure = _with_few_bars(figure, form.bars)
    across = (form.width if size is None else size[0]) * 72.0 * 0.96
    if form.brief:
        figure = _without_table(figure)
    elif figure.below:
        letters = int(across / (MONO_LETTER * (form.points or TABLE_POINTS)))
        figure = replace(figure, below=_table_in_blocks(figure.below, letters))
    height = form.height
    if form.column:
        figure = _in_one_column(figure)
        rows = 0 if figure.below else len(figure.legend())
        height = height * sum(figure.heights) + ROW * _letter_scale(form) * rows + 0.3
    size = size or (form.width, height + _table_height(figure, form))
    try:
        with _working_folder_without_settings():
            from matplotlib.figure import Figure as Canvas
        from matplotlib.layout_engine import ConstrainedLayoutEngine
    except ImportError:
        raise InputError(
            "drawing needs matplotlib, which is not installed: pip install 'allanite[plots]'"
        ) from None
    look = theme_of(theme)
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.0)
    canvas = Canvas(figsize=size, dpi=DPI, facecolor=look.ground, layout=layout)
    grid = canvas.add_gridspec(
        len(figure.heights),
        len(figure.widths),
        height_ratios=figure.heights,
        width_ratios=figure.widths,
    )
    for panel in figure.panels:
        place = grid[panel.row : panel.row + panel.rows, panel.column]
        share = AXES_SHARE * figure.widths[panel.column] / sum(figure.widths)
        width = 72.0 * size[0] * share / (BOLD_LETTER * (form.points or TABLE_POINTS))
        _draw_panel(canvas, canvas.add_subplot(place), panel, look, width)
    top, bottom = _draw_texts(canvas, figure, look, form)
    _apply_sizes(canvas, form)
    layout.set(rect=(0.0, bottom, 1.0, top - bottom))
    return canvas


@contextmanager
def _working_folder_without_settings() -> Iterator[None]:
    """Context manager in which matplotlib is imported without reading a ``matplotlibrc`` of the working folder.

    Such a file may come with a log, and could start LaTeX on the texts of a figure.
    """
    if "matplotlib" in sys.modules or not exists("matplotlibrc"):
        yield
        return
    with chdir(Path(__file__).parent):
        yield


def _in_one_column(figure: Figure) -> Figure:
    """Copy of a figure with all panels below each other, column by column, without title and subtitle."""
    ordered = sorted(figure.panels, key=lambda p: (p.column, p.row))
    heights = [sum(figure.heights[p.row : p.row + p.rows]) for p in ordered]
    most = max(heights)
    panels = []
    for row, panel in enumerate(ordered):
        # A strip shares the x axis of the panel above.
        below = row + 1 < len(ordered) and ordered[row + 1].x == panel.x
        # The label of the y axis says the same as most titles.
        title = "" if panel.y.label.startswith(panel.title) else panel.title
        panels.append(replace(panel, row=row, rows=1, column=0, show_x=not below, title=title))
    return replace(
        figure,
        title="",
        subtitle="",
        panels=tuple(panels),
        heights=tuple(h / most for h in heights),
        widths=(1.0,),
    )


def _with_few_bars(figure: Figure, most: int) -> Figure:
    """Copy of a figure with only the first `most` panels that have bars, and without the columns that become empty."""
    barred = [p for p in figure.panels if p.find(Bars)]
    panels = [p for p in figure.panels if p not in barred[most:]]
    columns = sorted({p.column for p in panels})
    return replace(
        figure,
        panels=tuple(replace(p, column=columns.index(p.column)) for p in panels),
        widths=tuple(figure.widths[c] for c in columns),
    )


def _without_table(figure: Figure) -> Figure:
    """Copy of a figure without its table; panels below the first row have only the unit as y label."""
    panels = tuple(
        replace(p, y=replace(p.y, label=p.y.label.rpartition(" (")[2].removesuffix(")")))
        if p.row > 0 and " (" in p.y.label
        else p
        for p in figure.panels
    )
    return replace(figure, panels=panels, below="")


def _letter_scale(form: Style) -> float:
    """Size of the letters of a style, relative to `TABLE_POINTS`, the size of tables and legends on the screen."""
    return (form.points or TABLE_POINTS) / TABLE_POINTS


def _table_height(figure: Figure, form: Style) -> float:
    """Height in inches of the table below a figure; 0 without a table."""
    return (
        len(figure.below.splitlines()) * TABLE_SPACING * TABLE_POINTS * _letter_scale(form) / 72.0
    )


def _table_in_blocks(table: str, letters: int) -> str:
    """Text of a table in blocks of at most `letters` width; each block repeats the first column."""
    lines = table.splitlines()
    if max(map(len, lines)) <= letters:
        return table
    columns = list(zip(*(re.split(r" {2,}", line.strip()) for line in lines), strict=True))
    widths = [max(map(len, column)) for column in columns]
    blocks, width = [[0]], widths[0]
    for i in range(1, len(columns)):
        if width + 2 + widths[i] > letters and len(blocks[-1]) > 1:
            blocks.append([0])
            width = widths[0]
        blocks[-1].append(i)
        width += 2 + widths[i]
    rows = range(len(lines))
    return "\n\n".join(
        "\n".join("  ".join(columns[i][r].rjust(widths[i]) for i in block) for r in rows)
        for block in blocks
    )


def _apply_sizes(canvas: Any, form: Style) -> None:
    """Set the sizes of letters, lines and points of a canvas to those of a style, in place.

    Nothing is changed if ``form.points`` is None (the style for the screen).
    """
    if form.points is None:
        return
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D
    from matplotlib.text import Text

    for text in canvas.findobj(Text):
        text.set_fontsize(form.points)
    for text in canvas.texts:
        if text.get_weight() == "bold":
            text.set_fontsize(TITLE_GROWTH * form.points)
    for line in canvas.findobj(Line2D):
        line.set_linewidth(form.strokes * line.get_linewidth())
        line.set_markersize(form.strokes * line.get_markersize())
    for lines in canvas.findobj(LineCollection):
        lines.set_linewidth([form.strokes * w for w in lines.get_linewidths()])


def _draw_texts(canvas: Any, figure: Figure, look: Theme, form: Style) -> tuple[float, float]:
    """Draw title, subtitle, table and legend; returns (top, bottom) of the panels as fractions of the height."""
    width, height = canvas.get_size_inches()
    grown = _letter_scale(form)
    bottom = 0.0
    if figure.below:
        bottom = (0.10 + _table_height(figure, form)) / height
        canvas.text(
            0.02, bottom, figure.below, ha="left", va="top", fontsize=TABLE_POINTS, color=look.text, family=MONO,
            parse_math=False, linespacing=TABLE_SPACING,
        )  # fmt: skip
    top = 0.13 if figure.title or figure.subtitle else 0.06
    style = {"ha": "left", "va": "top", "color": look.text} | TEXT
    size = TITLE_POINTS if form.points is None else TITLE_GROWTH * form.points
    letters = int(0.96 * 72.0 * width / (BOLD_LETTER * size))
    # A log may have a name of any length, which must not displace the curves.
    for part in textwrap.wrap(figure.title, letters, max_lines=2, placeholder=" …"):
        canvas.text(0.012, 1 - top / height, part, fontsize=TITLE_POINTS, weight="bold", **style)
        top += TITLE * size / TITLE_POINTS
    letters = int(LETTERS * width / WIDTH / grown * 0.95)
    for line in figure.subtitle.splitlines():
        for part in textwrap.wrap(line, letters) or [""]:
            canvas.text(0.012, 1 - top / height, part, fontsize=10.5, **style)
            top += LINE_HEIGHT * grown
    marks = figure.legend()
    below = 1 - (top + 0.02) / height
    if not marks:
        return below, bottom
    # matplotlib ignores labels that start with _.
    labels = [f" {label}" if (label := label_of(m)).startswith("_") else label for m in marks]
    # The legend is below the panels, or, if a table is there, in the upper right corner above falling curves.
    corner = bool(figure.below)
    owner = canvas.axes[0] if corner else canvas
    legend = owner.legend(
        handles=[_legend_symbol(m, look) for m in marks],
        labels=labels,
        loc="upper right" if corner else "outside lower center",
        ncols=1 if corner else _legend_columns(labels, LETTERS * width / WIDTH / grown),
        frameon=False,
        # The symbols of a legend have the size of these letters, also if the texts get another size later.
        prop={"family": FONT, "size": form.points or TABLE_POINTS},
        labelcolor=look.text,
        handlelength=2.2,
        labelspacing=0.5 / grown,
        columnspacing=1.8,
    )
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set(**_with_subscript(label))
    return below, bottom


def _with_subscript(text: str) -> dict[str, Any]:
    """Matplotlib properties `text` and `parse_math`: the y of σ_y becomes a subscript; all else stays literal.

    A text with a $ stays literal as a whole.
    """
    if "σ_y" not in text or "$" in text:
        return {"text": text, "parse_math": False}
    return {"text": text.replace("σ_y", r"$\sigma_y$"), "parse_math": True}


def _legend_columns(labels: list[str], letters: float) -> int:
    """Largest number of legend columns whose labels fit into a width of `letters` characters; at least 1."""
    for columns in range(len(labels), 1, -1):
        rows, longer = divmod(len(labels), columns)
        starts = [i * rows + min(i, longer) for i in range(columns + 1)]
        widths = [max(map(len, labels[a:b])) for a, b in itertools.pairwise(starts)]
        if sum(widths) + KEY * columns <= letters:
            return columns
    return 1


def _legend_symbol(mark: Mark, look: Theme) -> Any:
    """Matplotlib artist of a mark's symbol in the legend: patch, marker or line.

    Raises `TypeError` for a mark without a legend entry.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if isinstance(mark, Band | Span):
        alpha = mark.opacity if isinstance(mark, Band) else 0.25
        return Patch(facecolor=look.color(mark.color), alpha=alpha, linewidth=0)
    if isinstance(mark, Points):
        return Line2D([], [], linestyle="none", **_marker(mark, look))
    if isinstance(mark, Line | Rule):
        return Line2D([], [], **_stroke(mark, look))
    raise TypeError(type(mark).__name__)


def _marker(mark: Points, look: Theme) -> dict[str, Any]:
    """Marker properties of points for matplotlib; hollow points have the ground's color inside."""
    color = look.color(mark.color)
    return {
        "marker": "o",
        "markersize": mark.size,
        "markerfacecolor": look.panel if mark.hollow else color,
        "markeredgecolor": color,
        "markeredgewidth": 0.8,
    }


def _draw_panel(canvas: Any, axes: Any, panel: Panel, look: Theme, letters: float) -> None:
    """Draw a panel, its axes and its marks into matplotlib `axes`, whose width is about `letters` bold letters."""
    axes.set_facecolor(look.panel)
    for side, spine in axes.spines.items():
        spine.set_color(look.faint)
        spine.set_linewidth(0.8)
        spine.set_visible(side in ("left", "bottom"))
    axes.set_axisbelow(True)
    _set_axis(axes, "x", panel.x, panel.show_x, look)
    _set_axis(axes, "y", panel.y, panel.show_y, look)
    if panel.grid:
        axes.grid(visible=True, which="major", color=look.grid, linewidth=0.8)
    if panel.find(Bars):
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
    if panel.title:
        axes.set_title(
            panel.title, loc="left", fontsize=11, color=look.text, weight="bold", pad=6, **TEXT
        )
    texts = 0
    for mark in panel.marks:
        _draw_mark(canvas, axes, panel, mark, look)
        if isinstance(mark, Span) and mark.text:
            # Each text is below the previous one, because neighboring ranges are narrower than their texts.
            _draw_span_text(axes, mark, texts, panel.x, look, letters)
            texts += 1


def _set_axis(axes: Any, name: str, axis: Axis, show: bool, look: Theme) -> None:
    """Set scale, limits, ticks and label of one axis (`name`: x or y) of matplotlib `axes`; texts only with `show`."""
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

    getattr(axes, f"set_{name}scale")("log" if axis.log else "linear")
    limits = (axis.high, axis.low) if axis.reverse else (axis.low, axis.high)
    getattr(axes, f"set_{name}lim")(*limits)
    ink = getattr(axes, f"{name}axis")
    ink.set_major_locator(FixedLocator([v for v, _ in axis.ticks]))
    ink.set_major_formatter(FixedFormatter([t for _, t in axis.ticks]) if show else NullFormatter())
    ink.set_minor_locator(FixedLocator(list(axis.minor)))
    ink.set_minor_formatter(NullFormatter())
    axes.tick_params(
        axis=name,
        which="both",
        color=look.faint,
        labelcolor=look.text,
        labelsize=9.5,
        direction="out",
    )
    for label in getattr(axes, f"get_{name}ticklabels")():
        label.set_family(FONT)
    if show and axis.label:
        label = getattr(axes, f"set_{name}label")("", fontsize=10.5, color=look.text, family=FONT)
        label.set(**_with_subscript(axis.label))


def _draw_mark(canvas: Any, axes: Any, panel: Panel, mark: Mark, look: Theme) -> None:
    """Draw one mark of any kind into matplotlib `axes`; the text of a shaded range is drawn by `_draw_span_text`."""
    match mark:
        case Line():
            axes.plot(mark.x, mark.y, marker="none", zorder=LINE, **_stroke(mark, look))
        case Points():
            _draw_points(axes, mark, look)
        case Band():
            area = {"color": look.color(mark.color), "alpha": mark.opacity, "linewidth": 0}
            axes.fill_between(mark.x, mark.low, mark.high, zorder=AREA, **area)
        case Span():
            _draw_span(axes, mark, look)
        case Rule():
            draw = axes.axvline if mark.axis == "x" else axes.axhline
            draw(mark.value, zorder=GUIDE, **_stroke(mark, look))
        case Bars():
            _draw_bars(axes, mark, panel, look)
        case HeatMap():
            _draw_heat_map(canvas, axes, mark, look)
        case Note():
            style = {"ha": "center", "va": "center", "fontsize": 12, **TEXT}
            place = {"transform": axes.transAxes, "zorder": WORDS}
            axes.text(mark.x, mark.y, mark.text, color=look.color(mark.color), **place, **style)


def _stroke(mark: Line | Rule, look: Theme) -> dict[str, Any]:
    """Dict of the color, width and dash style of a line or rule, as keyword arguments of matplotlib."""
    color, dash = look.color(mark.color), DASHES[mark.dash]
    return {"color": color, "linewidth": mark.width, "linestyle": dash}


def _draw_span(axes: Any, mark: Span, look: Theme) -> None:
    """Draw a shaded range without its text; its edges keep a range visible that is narrower than a pixel."""
    color = look.color(mark.color)
    axes.axvspan(mark.low, mark.high, color=color, alpha=0.25, linewidth=0, zorder=BELOW)
    for edge in (mark.low, mark.high):
        axes.axvline(edge, color=color, linewidth=1.0, zorder=BELOW)


def _draw_span_text(
    axes: Any, mark: Span, line: int, axis: Axis, look: Theme, letters: float
) -> None:
    """Draw the text of a shaded range `line` lines below the upper edge of matplotlib `axes`, kept inside their width.

    `axis` is the x axis. `letters` is the width of the axes, as the number of bold letters that fit into it.
    """
    scale = np.log10 if axis.log else np.asarray
    first, last = scale(axis.low), scale(axis.high)
    middle = 0.5 * (max(scale(mark.low), first) + min(scale(mark.high), last))
    place, side = text_anchor(float((middle - first) / (last - first)), len(mark.text) / letters)
    axes.annotate(
        mark.text,
        (place, 0.985),
        (0.0, -1.5 * line),
        xycoords="axes fraction",
        textcoords="offset fontsize",
        ha=side,
        va="top",
        fontsize=9.5,
        weight="bold",
        color=look.text,
        zorder=WORDS,
        bbox={"facecolor": look.panel, "edgecolor": "none", "pad": 0.8, "alpha": 0.8},
        **TEXT,
    )


def _draw_points(axes: Any, mark: Points, look: Theme) -> None:
    """Draw markers, with error bars where both ends are finite, into matplotlib `axes`."""
    if mark.low is not None and mark.high is not None:
        kept = np.isfinite(mark.low) & np.isfinite(mark.high)
        axes.vlines(
            mark.x[kept],
            mark.low[kept],
            mark.high[kept],
            color=look.color(mark.color),
            linewidth=0.9,
            alpha=0.75,
            zorder=POINT,
        )
    axes.plot(mark.x, mark.y, linestyle="none", zorder=POINT, **_marker(mark, look))


def _draw_bars(axes: Any, mark: Bars, panel: Panel, look: Theme) -> None:
    """Draw horizontal bars, each with its text at the end, into matplotlib `axes`; NaN has the length 0."""
    places = np.arange(mark.values.size)
    values = np.nan_to_num(mark.values)
    axes.barh(places, values, height=0.5, color=[look.color(c) for c in mark.colors], zorder=LINE)
    margin = 0.025 * (panel.x.high - panel.x.low)
    for place, value, text in zip(places, values, mark.texts, strict=True):
        axes.text(
            value + margin if value >= 0 else value - margin,
            place,
            text,
            ha="left" if value >= 0 else "right",
            va="center",
            fontsize=10,
            color=look.text,
            zorder=WORDS,
            bbox={"facecolor": look.panel, "edgecolor": "none", "pad": 0.8},
            **TEXT,
        )


def _draw_heat_map(canvas: Any, axes: Any, mark: HeatMap, look: Theme) -> None:
    """Draw a heat map with its color bar and frames around marked cells; cells that are NaN have the color of the grid."""
    from matplotlib.colors import LinearSegmentedColormap

    blank = LinearSegmentedColormap.from_list("ratio", list(look.diverging))
    colors = blank.with_extremes(bad=look.grid)
    mesh = axes.pcolormesh(
        mark.x_edges,
        mark.y_edges,
        np.ma.masked_invalid(mark.values),
        cmap=colors,
        vmin=-mark.limit,
        vmax=mark.limit,
        linewidth=0,
        rasterized=False,
        zorder=AREA,
    )
    for row, column in np.argwhere(mark.marked):
        x0, x1 = mark.x_edges[column : column + 2]
        y0, y1 = mark.y_edges[row : row + 2]
        axes.plot(
            [x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color=look.text, linewidth=1.0, zorder=LINE
        )
    bar = canvas.colorbar(mesh, ax=axes, pad=0.015, fraction=0.05)
    bar.outline.set_visible(False)
    bar.solids.set_edgecolor("face")  # avoids thin lines between shades
    bar.solids.set_rasterized(False)  # a page can recolor vector graphics, but not embedded images
    bar.set_ticks([v for v, _ in mark.ticks], labels=[t for _, t in mark.ticks])
    bar.ax.tick_params(labelsize=9.5, color=look.faint, labelcolor=look.text)
    for label in bar.ax.get_yticklabels():
        label.set_family(FONT)
    bar.set_label(mark.label, fontsize=10.5, color=look.text, **TEXT)

"""Figures as plain data: marks, panels and axes, which the painters draw."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.showing import brief

Array = NDArray[np.float64]


def text_anchor(middle: float, width: float) -> tuple[float, str]:
    """(position, alignment) of a text with a `width` around a `middle`, all relative to the axis (0 to 1).

    The text is ``"center"`` at the middle. If it would leave the axis, it is ``"left"`` at 0 or ``"right"`` at 1.
    """
    if middle < 0.5 * width:
        return 0.0, "left"
    return (1.0, "right") if middle > 1.0 - 0.5 * width else (middle, "center")


def _freeze_arrays(thing: object, *names: str) -> None:
    """Convert the named fields of an object to read-only float arrays, in place; None stays None.

    Raises `InputError` unless the arrays have equal shapes.
    """
    sizes = set()
    for name in names:
        value = getattr(thing, name)
        if value is None:
            continue
        array = np.array(value, dtype=np.float64)
        array.flags.writeable = False
        object.__setattr__(thing, name, array)
        sizes.add(array.shape)
    if len(sizes) > 1:
        raise InputError(f"{type(thing).__name__}: {', '.join(names)} differ in length: {sizes}")


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """Line through (x, y), shape (k,); `color` is a role of the palette (`themes`), `dash` solid, dash or dot."""

    x: Array
    y: Array
    color: str
    label: str = ""
    width: float = 1.6
    dash: str = "solid"

    __repr__ = brief

    def __post_init__(self) -> None:
        _freeze_arrays(self, "x", "y")


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Markers at (x, y), shape (k,), with 95 % intervals `low`…`high` if given."""

    x: Array
    y: Array
    color: str
    label: str = ""
    low: Array | None = None
    high: Array | None = None
    size: float = 4.0
    hollow: bool = False

    __repr__ = brief

    def __post_init__(self) -> None:
        _freeze_arrays(self, "x", "y", "low", "high")


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """The area between `low` and `high` over x, shape (k,), with an opacity from 0 to 1."""

    x: Array
    low: Array
    high: Array
    color: str
    label: str = ""
    opacity: float = 0.2

    __repr__ = brief

    def __post_init__(self) -> None:
        _freeze_arrays(self, "x", "low", "high")

    def gap_free_ranges(self) -> list[NDArray[np.intp]]:
        """One index array per range of consecutive points at which both `low` and `high` are finite."""
        there = np.isfinite(self.low) & np.isfinite(self.high)
        ranges = np.split(np.arange(there.size), np.flatnonzero(np.diff(there)) + 1)
        return [piece for piece in ranges if there[piece].any()]


@dataclass(frozen=True, slots=True)
class Span:
    """Shaded range of the x axis over the whole height, with `text` at its top."""

    low: float
    high: float
    color: str
    label: str = ""
    text: str = ""


@dataclass(frozen=True, slots=True)
class Rule:
    """Straight line across the panel at one value of the `axis` (x or y)."""

    value: float
    axis: str
    color: str
    dash: str = "dash"
    label: str = ""
    width: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Bars:
    """Horizontal bars from 0, one per category (y = 0, 1, …), each with a color and a text at its end."""

    values: Array
    texts: tuple[str, ...]
    colors: tuple[str, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        _freeze_arrays(self, "values")
        if not len(self.texts) == len(self.colors) == self.values.size:
            raise InputError(
                f"Bars: {self.values.size} values, {len(self.texts)} texts, {len(self.colors)} colors"
            )


@dataclass(frozen=True, slots=True, eq=False)
class HeatMap:
    """Map of colored cells.

    Attributes
    ----------
    x_edges, y_edges : ndarray, shapes (columns + 1,) and (rows + 1,)
    values : ndarray, shape (rows, columns)
        NaN for empty cells; the color scale covers −limit … +limit.
    ticks : tuple of (value, text)
        Ticks of the color bar.
    marked : ndarray of bool, shape (rows, columns)
        Significant cells, which are framed.
    """

    x_edges: Array
    y_edges: Array
    values: Array
    limit: float
    label: str
    ticks: tuple[tuple[float, str], ...]
    marked: NDArray[np.bool_]

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("x_edges", "y_edges", "values"):
            _freeze_arrays(self, name)
        shape = (self.y_edges.size - 1, self.x_edges.size - 1)
        if self.values.shape != shape or self.marked.shape != shape:
            raise InputError(f"HeatMap: values of shape {self.values.shape} for edges of {shape}")


@dataclass(frozen=True, slots=True)
class Note:
    """Text at a position of the panel; both coordinates run from 0 to 1."""

    x: float
    y: float
    text: str
    color: str = "text"


Mark = Line | Points | Band | Span | Rule | Bars | HeatMap | Note


def label_of(mark: Mark) -> str:
    """Label of a mark in the legend; empty if the mark has no legend entry."""
    return "" if isinstance(mark, HeatMap | Note | Bars) else mark.label


@dataclass(frozen=True, slots=True)
class Quantity:
    """What an axis shows: `words` of its label, the `unit` of the samples, and the `power` of that unit.

    The power is 1 for samples and deviations and 2 for densities.
    """

    words: str
    unit: str
    power: int = 1
    samples: bool = False


@dataclass(frozen=True, slots=True)
class Axis:
    """Axis of a panel: label with unit, limits, and ticks.

    `ticks` are tuples (value, text); minor ticks have no text. `reverse` puts the low end at the top (or right).
    `quantity` is None if the axis has no unit of samples.
    """

    label: str
    low: float
    high: float
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()
    minor: tuple[float, ...] = ()
    reverse: bool = False
    quantity: Quantity | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise InputError(f"axis {self.label!r}: limits {self.low} … {self.high}")
        if self.log and self.low <= 0:
            raise InputError(f"axis {self.label!r}: a logarithmic axis cannot start at {self.low}")


@dataclass(frozen=True, slots=True)
class Panel:
    """Marks on a pair of axes, at a position in the grid of the figure."""

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    row: int = 0
    column: int = 0
    rows: int = 1
    title: str = ""
    #: True to draw tick texts and the axis label; a strip below a curve shares the axis of the curve.
    show_x: bool = True
    show_y: bool = True
    #: True to draw grid lines.
    grid: bool = True

    def find(self, kind: type[Any]) -> tuple[Any, ...]:
        """Tuple of all marks of the class `kind`, in drawing order."""
        return tuple(m for m in self.marks if isinstance(m, kind))


@dataclass(frozen=True, slots=True, repr=False)
class Figure:
    """Figure as data: panels on a grid, with title and subtitle.

    Attributes
    ----------
    title, subtitle : str
    panels : tuple of Panel
    heights, widths : tuple of float
        Relative sizes of the grid's rows and columns.
    kind : str
        Kind of figure: ``fit``, ``check``, ``study``, …
    below : str
        Text of a table below the panels, in a monospaced font; drawn only by matplotlib.
    """

    title: str
    subtitle: str
    panels: tuple[Panel, ...]
    heights: tuple[float, ...] = (1.0,)
    widths: tuple[float, ...] = (1.0,)
    kind: str = ""
    below: str = ""

    def legend(self) -> tuple[Mark, ...]:
        """One mark per label: points first, then marks in the color of the model, then others."""
        seen: dict[str, Mark] = {}
        for panel in self.panels:
            for mark in panel.marks:
                label = label_of(mark)
                if label:
                    seen.setdefault(label, mark)

        def rank(mark: Mark) -> int:
            """Sort key of a mark: 0 for points, 1 for the model, 2 for all others."""
            return (
                0 if isinstance(mark, Points) else 1 if getattr(mark, "color", "") == "model" else 2
            )

        return tuple(sorted(seen.values(), key=rank))

    def to_plotly(self, theme: str = "light") -> dict[str, Any]:
        """Dict ``{"data": […], "layout": {…}}``: the figure as plotly's JSON document."""
        from allanite.plots.plotly_painter import paint

        return paint(self, theme)

    def to_matplotlib(self, theme: str = "light", size: tuple[float, float] = (12.8, 7.2)) -> Any:
        """New ``matplotlib.figure.Figure`` of `size` inches, which can be modified."""
        from allanite.plots.matplotlib_painter import draw

        return draw(self, theme, size)

    def save(self, path: str | Path, theme: str = "light", style: str = "screen") -> None:
        """Write SVG, PNG or PDF, as the suffix of `path` says; `style` is screen, paper (one column, 8 pt) or slides."""
        from allanite.plots.matplotlib_painter import save

        save(self, path, theme, style)

    def saved(self, path: str | Path | None, theme: str = "light") -> Figure:
        """`Figure` itself, unchanged, after writing it to `path` (SVG, PNG or PDF) unless `path` is None."""
        if path is not None:
            self.save(path, theme)
        return self

    def _repr_svg_(self) -> str:
        """Text of the figure as SVG, for notebooks."""
        from allanite.plots.matplotlib_painter import render

        return render(self, "svg").decode()

    def __repr__(self) -> str:
        return f"Figure({self.kind}: {self.title})"

"""How a report was computed, and its numbers in full."""

from __future__ import annotations

import platform
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common.numbers import tidy
from allanite.plots.words import unit_text
from allanite.report.blocks import Block, Cell, Heading, Number, Paragraph, Table
from allanite.report.words import many

if TYPE_CHECKING:
    from allanite.report.document import Report

__all__ = ["computed", "curve_table"]

METHOD = (
    "Coefficients are those of the Whittle likelihood of cosine ordinates in 24 cells a decade, each of up to eight bins, "
    "with deterministic effects fitted by generalised least squares in the same ordinates. Model curves are those of the "
    "discrete process, not of asymptotic lines. p-values account for the number of shapes, frequencies, times and "
    "effects searched; a check raises a false alarm in about 1 % of records. Statistical significance is not size: both "
    "are given throughout."
)


def computed(report: Report) -> list[Block]:
    """Version, options and method."""
    import numpy as np
    import scipy

    rows: list[tuple[Cell, ...]] = [("version", f"allanite {_kernels.version()}")]
    rows += [(name, value) for name, value in report.options.items()]
    rows.append(("method", METHOD))
    rows.append(
        (
            "with",
            f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}",
        )
    )
    return [Heading("How it was computed"), Table((), tuple(rows))]


def curve_table(document: dict[str, Any], place: str) -> list[Block]:
    """The overlapping Allan deviation, every point of it."""
    at = f"{place}." if place else ""
    adev, unit = document["adev"], unit_text(document["recording"]["unit"])
    rows: list[tuple[Cell, ...]] = []
    for i, point in enumerate(adev["points"]):
        where = f"{at}adev.points.{i}"
        rows.append(
            tuple(
                _plain(point[name], f"{where}.{name}", form)
                for name, form in (
                    ("tau_s", ".6g"),
                    ("m", "count"),
                    ("n", "count"),
                    ("deviation", ".5g"),
                    ("low", ".5g"),
                    ("high", ".5g"),
                    ("edf", "count"),
                )
            )
        )
    head = ("τ (s)", "m", "terms", f"deviation ({unit})", "95 % low", "high", "edf")
    words = "Overlapping Allan deviation. The interval needs no model: the noise is identified at each τ."
    table = Table(head, tuple(rows), tuple(range(7)), small=True)
    return [Heading("The curve in numbers"), Paragraph(words, "quiet"), table]


def _plain(value: float | None, place: str, form: str) -> Cell:
    if value is None:
        return "–"
    if form == "count":
        text = many(value) if value >= 100 or value == int(value) else f"{value:.3g}"
    else:
        text = tidy(format(value, form))
    return Number(text, float(value), place)

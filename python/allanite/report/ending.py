"""Blocks of all columns, and the last sections of a report: version, options, method, table of the deviation."""

from __future__ import annotations

import platform
from functools import partial
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common.numbers import count_text, with_readable_numbers
from allanite.common.threads import results_or_raise, side_by_side
from allanite.plots.words import unit_text
from allanite.report.blocks import Block, Cell, Heading, Number, Paragraph, Table
from allanite.report.content import column_section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.report.document import Entry, Report

#: Description of the method in the last section of a report.
METHOD = (
    "Coefficients maximize the Whittle likelihood of cosine-transform ordinates in 24 cells per decade, each of up to "
    "eight bins. Deterministic effects are fitted by generalized least squares in the same ordinates. Model curves are "
    "those of the discrete process, not asymptotic lines. p-values account for the number of shapes, frequencies, times "
    "and effects searched; the false-alarm probability of a check is about 1 % per record. A significant effect is not "
    "always large, so the report gives significance and size."
)


def method_section(report: Report) -> list[Block]:
    """List of `Block`: section on how the report was computed: version, options, method, and versions of the libraries."""
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
    return [Heading("How this report was computed"), Table((), tuple(rows))]


def column_blocks(entries: Sequence[Entry], places: Sequence[str]) -> list[list[Block]]:
    """List of lists: all blocks of each column; several columns are computed in parallel.

    `places` are the paths of the columns in the JSON document. Raises the error of the first column that fails.
    """

    def blocks(entry: Entry, place: str) -> list[Block]:
        """List of `Block`: all blocks of one column, with the table of its deviation at the end."""
        document = entry.to_shown_dict()
        return [
            # The first page shows the curve of a single column.
            *column_section(entry, document, place, with_curve=len(entries) > 1),
            *curve_table(document, place),
        ]

    tasks = [partial(blocks, *one) for one in zip(entries, places, strict=True)]
    return results_or_raise(side_by_side(tasks))


def curve_table(document: dict[str, Any], place: str) -> list[Block]:
    """List of `Block`: section with all points of the overlapping Allan deviation."""
    at = f"{place}." if place else ""
    adev, unit = document["adev"], unit_text(document["recording"]["unit"])
    rows: list[tuple[Cell, ...]] = []
    for i, point in enumerate(adev["points"]):
        where = f"{at}adev.points.{i}"
        rows.append(
            tuple(
                _formatted_cell(point[name], f"{where}.{name}", form)
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
    head = ("τ (s)", "m", "differences", f"deviation ({unit})", "95 % low", "high", "edf")
    words = "Overlapping Allan deviation. The interval uses the noise type identified at each τ and needs no model."
    table = Table(head, tuple(rows), tuple(range(7)), small=True)
    return [Heading("Allan deviation in numbers"), Paragraph(words, "quiet"), table]


def _formatted_cell(value: float | None, place: str, form: str) -> Cell:
    """`Number` that prints `value` in the format `form` (a format specification, or "count" for counts); ``–`` for None.

    `place` is the path of the value in the JSON document of the report.
    """
    if value is None:
        return "–"
    if form == "count":
        text = count_text(value) if value >= 100 or value == int(value) else f"{value:.3g}"
    else:
        text = with_readable_numbers(format(value, form))
    return Number(text, float(value), place)

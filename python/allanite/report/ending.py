"""All sections of a report in their order, and the last one: version, options and method."""

from __future__ import annotations

import platform
from functools import partial
from typing import TYPE_CHECKING

from allanite import _kernels
from allanite.common.threads import results_or_raise, side_by_side
from allanite.report.blocks import Block, Heading, Table
from allanite.report.content import column_section
from allanite.report.overview import overview_blocks
from allanite.report.summary import first_page_blocks

if TYPE_CHECKING:
    from allanite.report.document import Report

#: Description of the method in the last section of a report.
METHOD = (
    "Coefficients maximize the Whittle likelihood of cosine-transform ordinates in 24 cells per decade, each of up to "
    "eight bins. Deterministic effects are fitted by generalized least squares in the same ordinates. Model curves are "
    "those of the discrete process, not asymptotic lines. p-values account for the number of shapes, frequencies, times "
    "and effects searched; the false-alarm probability of a check is about 1 % per record. A significant effect is not "
    "always large, so the report gives significance and size."
)


def report_sections(report: Report) -> list[tuple[str, list[Block]]]:
    """(name of a column or ``""``, blocks): all parts of a report, in the order of the page.

    Raises the error of the first column that fails.
    """
    several = len(report.entries) > 1
    overview = overview_blocks(report.axes) if several and report.axes is not None else []
    ending = [Heading("All columns", 2)] if several else []
    names = [entry.recording.columns[0] for entry in report.entries]
    # The first page shows the curve of a single column.
    tasks = [partial(column_section, entry, with_curve=several) for entry in report.entries]
    columns = results_or_raise(side_by_side(tasks))
    return [
        ("", first_page_blocks(report)),
        ("", overview),
        *zip(names, columns, strict=True),
        ("", [*ending, *_method_section(report)]),
    ]


def _method_section(report: Report) -> list[Block]:
    """List of `Block`: section on how the report was computed: version, options, method, and versions of the libraries."""
    import numpy as np
    import scipy

    libraries = (
        f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"
    )
    rows = (
        ("version", f"allanite {_kernels.version()}"),
        *report.options.items(),
        ("method", METHOD),
        ("with", libraries),
    )
    return [Heading("How this report was computed"), Table((), rows)]

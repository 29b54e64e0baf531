"""Comparison of logs, models and data sheets, and the acceptance test of a sensor.

To add a figure of data sheets, name it in the `figures` of the parameter of an effect.
"""

from __future__ import annotations

from allanite.comparison.acceptance import Acceptance, accept, accept_study, limit_line
from allanite.comparison.curves import (
    Curves,
    Drawn,
    compare,
    curves_of_deviations,
    curves_of_studies,
)
from allanite.comparison.datasheet import compare_datasheet
from allanite.sources.datasheet import DataSheet, Quoted, read_datasheet

__all__ = [
    "Acceptance",
    "Curves",
    "DataSheet",
    "Drawn",
    "Quoted",
    "accept",
    "accept_study",
    "compare",
    "compare_datasheet",
    "curves_of_deviations",
    "curves_of_studies",
    "limit_line",
    "read_datasheet",
]

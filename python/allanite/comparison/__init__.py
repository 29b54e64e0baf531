"""Logs, models and data sheets side by side."""

from __future__ import annotations

from allanite.comparison.curves import Curves, Drawn, compare
from allanite.comparison.datasheet import DataSheet, compare_datasheet, read_datasheet

__all__ = ["Curves", "DataSheet", "Drawn", "compare", "compare_datasheet", "read_datasheet"]

"""Logs, models and data sheets side by side."""

from __future__ import annotations

from allanite.comparison.curves import Curve, Curves, compare
from allanite.comparison.datasheet import DataSheet, compare_datasheet, read_datasheet

__all__ = ["Curve", "Curves", "DataSheet", "compare", "compare_datasheet", "read_datasheet"]

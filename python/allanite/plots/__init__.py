"""Figures as plain data (`spec.py`), and painters for files and for the page.

Add a figure as a function that returns a `Figure`; each painter draws all marks of `spec.py`.
"""

from __future__ import annotations

from allanite.plots.compare import plot_compare
from allanite.plots.deviation import plot_deviation, plot_dynamic, plot_stability
from allanite.plots.fit import plot_check, plot_fit
from allanite.plots.recording import plot_recording
from allanite.plots.spec import Figure
from allanite.plots.study import plot_study
from allanite.plots.time import plot_time

__all__ = [
    "Figure",
    "plot_check",
    "plot_compare",
    "plot_deviation",
    "plot_dynamic",
    "plot_fit",
    "plot_recording",
    "plot_stability",
    "plot_study",
    "plot_time",
]

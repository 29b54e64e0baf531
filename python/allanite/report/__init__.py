"""The report: what was recorded, how it was modelled, where that failed and what is left, in one file."""

from __future__ import annotations

from allanite.report.document import Entry, Report, make_report

__all__ = ["Entry", "Report", "make_report"]

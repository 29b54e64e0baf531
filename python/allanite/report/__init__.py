"""Reports: record, model, failures and remaining misfit in one HTML or Markdown file.

A `Report` (`make_report`) is made of blocks, whose numbers are those of the JSON documents. Add a section in
`content.py`; `html.py` and `markdown.py` draw every kind of block.
"""

from __future__ import annotations

from allanite.report.document import Entry, Report, make_report, report_of

__all__ = ["Entry", "Report", "make_report", "report_of"]

"""Summaries: a record of any length in a few megabytes.

Input: chunks of samples in any order (`summarize`). Output: a `Summary` that fits, checks and studies accept. Add a
statistic that merges without depending on the order in `level.py` or `lines.py`.
"""

from __future__ import annotations

from allanite.summary.making import summarize
from allanite.summary.summary import Summary

__all__ = ["Summary", "summarize"]

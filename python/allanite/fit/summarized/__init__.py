"""Fits to summaries: prepared data of a summary, and errors for requests that need single samples.

Input: a summary. Output: data that fits, checks and studies use in place of a recording. Add what a summary can
answer in `data.py`.
"""

from allanite.fit.summarized.data import of_summary, require_summary_supports

__all__ = ["of_summary", "require_summary_supports"]

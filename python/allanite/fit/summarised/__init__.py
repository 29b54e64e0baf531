"""Fits to summaries: prepared data of a summary, and errors for requests that need single samples."""

from allanite.fit.summarised.data import of_summary, require_summary_supports

__all__ = ["of_summary", "require_summary_supports"]

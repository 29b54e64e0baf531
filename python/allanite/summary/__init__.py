"""A record of any length in a few megabytes."""

from __future__ import annotations

from allanite.summary.making import summarise
from allanite.summary.summary import Summary

__all__ = ["Summary", "summarise"]

"""Many logs, long logs and growing logs: summaries on a cluster, fleets, and a watch.

Input: chunks, paths or a stream. Output: summaries, a table with one row per axis, or alarms. Add a column of a
fleet's table in `logs.py`, and a bet of the watch in `bets.py`.
"""

from __future__ import annotations

import warnings

from allanite.scale.engine import Summaries, summarize
from allanite.scale.logs import run_fleet
from allanite.scale.population import Fleet, fleet
from allanite.scale.watch import Alarm, Watch

__all__ = ["Alarm", "Fleet", "Summaries", "Watch", "fleet", "run_fleet", "summarize"]


def __getattr__(name: str) -> object:
    """Function `summarize` for its former name ``summarise``, with a `DeprecationWarning`; else `AttributeError`."""
    if name == "summarise":
        message = "al.scale.summarise is now al.scale.summarize"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return summarize
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

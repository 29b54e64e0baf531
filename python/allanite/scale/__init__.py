"""Many logs, long logs and growing logs: summaries on a cluster, fleets, and a watch.

Input: chunks, paths or a stream. Output: summaries, a table with one row per axis, or alarms. Add a column of a
fleet's table in `logs.py`, and a bet of the watch in `bets.py`.
"""

from __future__ import annotations

from allanite.common.former import warn_of_former_name
from allanite.scale.engine import Summaries, summarize
from allanite.scale.logs import run_fleet
from allanite.scale.population import Fleet, fleet
from allanite.scale.watch import Alarm, Watch

__all__ = ["Alarm", "Fleet", "Summaries", "Watch", "fleet", "run_fleet", "summarize"]


def __getattr__(name: str) -> object:
    """Function `summarize` for its former name ``summarise``, with a `DeprecationWarning`; else `AttributeError`."""
    if name == "summarise":
        warn_of_former_name("al.scale.summarise", "al.scale.summarize")
        return summarize
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

"""Many logs, long logs and logs that do not end: summaries on a cluster, fleets, and a watch."""

from __future__ import annotations

from allanite.scale.engine import Summaries, summarise
from allanite.scale.logs import run_fleet
from allanite.scale.population import Fleet, fleet
from allanite.scale.watch import Alarm, Watch

__all__ = ["Alarm", "Fleet", "Summaries", "Watch", "fleet", "run_fleet", "summarise"]

"""Every axis of a sensor at once: the ladder of each, one table, and what the axes have in common."""

from __future__ import annotations

from allanite.axes.characterization import Characterization, Common, Sensor
from allanite.axes.run import characterize
from allanite.axes.twin import Twin, twin

__all__ = ["Characterization", "Common", "Sensor", "Twin", "characterize", "twin"]

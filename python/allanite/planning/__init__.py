"""How long to record, and how fast, before anything is recorded: what a fit will know and a check will find."""

from allanite.planning.detection import Power, detection_power
from allanite.planning.duration import Plan, plan

__all__ = ["Plan", "Power", "detection_power", "plan"]

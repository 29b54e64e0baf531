"""Model strings from which a search starts if the user names none."""

from __future__ import annotations

#: Angle random walk, bias instability and rate random walk; and the five noises of a clock (IEEE 1139-2008).
SENSOR_START, CLOCK_START = "N+B+K", "Q+F+N+B+K"

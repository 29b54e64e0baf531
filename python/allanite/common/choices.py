"""Names and models from which a user chooses, for the functions that take them and the help of the commands."""

from __future__ import annotations

#: Quantities that a log may contain. An increment is the integral of the rate over one sample interval. An angle is the
#: integral of the rate since the start.
QUANTITIES = ("rate", "increment", "angle")
#: Methods of a fit: Whittle likelihood, generalized least squares on the Allan curve, straight lines on it.
METHODS = ("whittle", "gls", "lines")
#: Models from which a search starts if the user names none: angle random walk, bias instability and rate random walk; and
#: the five noises of a clock (IEEE 1139-2008).
SENSOR_START, CLOCK_START = "N+B+K", "Q+F+N+B+K"

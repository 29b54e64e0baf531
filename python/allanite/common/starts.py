"""Model strings from which a search starts if the user names none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Angle random walk, bias instability and rate random walk; and the five noises of a clock (IEEE 1139-2008).
SENSOR_START, CLOCK_START = "N+B+K", "Q+F+N+B+K"


def start_model(quantity: str, units: Sequence[str]) -> str:
    """First model of a search, as a string: ``"Q+F+N+B+K"`` for the phase of a clock, ``"N+B+K"`` for all other samples.

    Parameters
    ----------
    quantity : str
        ``"rate"`` or ``"angle"``.
    units : sequence of str
        Unit of the rate of each column; ``"1"`` for the fractional frequency of a clock.
    """
    return CLOCK_START if quantity == "angle" and set(units) == {"1"} else SENSOR_START

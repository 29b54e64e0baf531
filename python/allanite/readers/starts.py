"""Model string from which a search starts if the user names none."""

from __future__ import annotations

from allanite.common.choices import CLOCK_START, SENSOR_START
from allanite.common.units import FREQUENCY
from allanite.recording import Recording
from allanite.recording.sensor_names import kind_of_sensor


def start_model(recording: Recording) -> str:
    """First model of a search, as a string: ``"Q+F+N+B+K"`` if all columns are clocks, ``"N+B+K"`` for other sensors."""
    kinds = {kind_of_sensor(n, u) for n, u in zip(recording.columns, recording.units, strict=True)}
    return CLOCK_START if kinds == {FREQUENCY} else SENSOR_START

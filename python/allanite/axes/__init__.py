"""Models of every axis of a sensor at once (`characterize`), and what the axes have in common.

Add a comparison between axes as a module here, and print its result in `rows.py` and `words.py`.
"""

from __future__ import annotations

from allanite.axes.characterization import Characterization, Common, Sensor
from allanite.axes.run import characterize
from allanite.axes.twin import Twin, twin

__all__ = ["Characterization", "Common", "Sensor", "Twin", "characterize", "twin"]

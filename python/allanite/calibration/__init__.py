"""Thermal calibration: the temperature law b(T) of every axis, from logs of a warm-up or a chamber run (`thermal`).

Add a form of the law in `forms.py`, and a parameter file as a function in `targets.py`.
"""

from __future__ import annotations

from allanite.calibration.law import AxisLaw
from allanite.calibration.thermal import ThermalCalibration, thermal

__all__ = ["AxisLaw", "ThermalCalibration", "thermal"]

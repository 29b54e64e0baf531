"""Thermal calibration: warm-up or chamber logs go in, the law b(T) of every axis comes out.

`runs.py` joins logs, `forms.py` chooses the form by evidence, `band.py` makes the confidence band, `remains.py` says what
the correction leaves. A new parameter file is a function in `targets.py`.
"""

from __future__ import annotations

from allanite.calibration.law import AxisLaw
from allanite.calibration.thermal import ThermalCalibration, thermal

__all__ = ["AxisLaw", "ThermalCalibration", "thermal"]

"""Recordings: samples of a sensor, their time stamps, gaps and units, and the audit of the data.

Input: arrays, time stamps and a unit. Output: a `Recording` with findings. Add a check of the data as a function that
returns findings, and append the function to `CHECKS` in `audit.py`.
"""

from __future__ import annotations

from allanite.recording.recording import Recording
from allanite.recording.samples import find_column

__all__ = ["Recording", "find_column"]

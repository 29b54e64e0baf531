"""Samples of a sensor, what their time stamps say, and what is wrong with them."""

from __future__ import annotations

from allanite.recording.recording import Recording, find_column

__all__ = ["Recording", "find_column"]

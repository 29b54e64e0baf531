"""The one door to the compiled core: array conversion and argument order, nothing else."""

from __future__ import annotations

from allanite import _core

__all__ = ["version"]

version = _core.version

"""Parameters of a model for filters and simulators: one target a file, one registry."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS", "export"]

# Name on the command line → module of this package; its `render(axes, rate)` returns the text.
TARGETS = {
    "json": "plain_json",
    "kalibr": "kalibr",
    "matlab": "matlab",
    "ros": "ros",
    "vins": "vins",
    "gtsam": "gtsam",
}


def export(axes: Sequence[Axis], target: str, rate: float | None = None) -> str:
    """Text of a parameter file.

    Parameters
    ----------
    axes : sequence of Axis
        See `allanite.export._axis.axes_of`.
    target : str
        One of `TARGETS`.
    rate : float, optional
        Sampling rate in Hz for targets whose numbers are per sample; else the recording's.

    Raises
    ------
    InputError
        Unknown target, or the model lacks what the target needs.
    """
    if target not in TARGETS:
        raise InputError(f"unknown export format {target!r}: one of {', '.join(TARGETS)}")
    text: str = import_module(f"allanite.export.{TARGETS[target]}").render(axes, rate)
    return text

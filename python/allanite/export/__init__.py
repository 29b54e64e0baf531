"""Parameters of a model for filters and simulators: one target a file, one registry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.export import gtsam, kalibr, matlab, plain_json, ros, vins

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS", "export"]

# Name on the command line → text of a parameter file for some axes at a rate.
TARGETS: dict[str, Callable[[Sequence[Axis], float | None], str]] = {
    "json": plain_json.render,
    "kalibr": kalibr.render,
    "matlab": matlab.render,
    "ros": ros.render,
    "vins": vins.render,
    "gtsam": gtsam.render,
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
    return TARGETS[target](axes, rate)

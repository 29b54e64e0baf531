"""Parameters of a model for filters and simulators: one target a file, one registry."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS", "export"]

# Name on the command line → module of this package; its `render(axes, rate, overbound=…)` returns the text.
TARGETS = {
    "json": "plain_json",
    "kalibr": "kalibr",
    "matlab": "matlab",
    "ros": "ros",
    "vins": "vins",
    "gtsam": "gtsam",
    "orbslam3": "orbslam3",
    "liosam": "liosam",
    "fastlio": "fastlio",
    "px4": "px4",
    "ardupilot": "ardupilot",
    "gazebo": "gazebo",
    "airsim": "airsim",
    "kfgins": "kfgins",
    "gnss-ins-sim": "gnss_ins_sim",
    "c-header": "c_header",
    "statespace": "statespace",
}
#: Targets whose numbers hold for the rate of the filter, not of the sensor.
OWN_RATE = ("px4", "ardupilot")


def export(
    axes: Sequence[Axis],
    target: str,
    rate: float | None = None,
    *,
    overbound: bool = False,
    until: float | None = None,
) -> str:
    """Text of a parameter file.

    Parameters
    ----------
    axes : sequence of Axis
        See `allanite.export._axis.axes_of`.
    target : str
        One of `TARGETS`.
    rate : float, optional
        Sampling rate in Hz for targets whose numbers are per sample; else the recording's.
    overbound : bool
        Whether N and K (or N and a lag) are the smallest whose density and Allan variance are above the model's upper
        limits at every τ of use.
    until : float, optional
        Longest τ of use, s; else a tenth of the recording.

    Raises
    ------
    InputError
        Unknown target, or the model lacks what the target needs.
    """
    if target not in TARGETS:
        raise InputError(f"unknown export format {target!r}: one of {', '.join(TARGETS)}")
    from allanite.export._axis import used

    own = [used(axis, None if target in OWN_RATE else rate, until) for axis in axes]
    module = import_module(f"allanite.export.{TARGETS[target]}")
    text: str = module.render(own, rate, overbound=overbound)
    return text

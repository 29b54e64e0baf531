"""Parameters of a model for filters and simulators: one target a file, one registry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE
from allanite.export import c_header, matlab, plain_json, ros, statespace
from allanite.export.filters import (
    ardupilot,
    fastlio,
    gtsam,
    kalibr,
    kfgins,
    liosam,
    openvins,
    orbslam3,
    px4,
    vins,
)
from allanite.export.simulators import airsim, gazebo, gnss_ins_sim

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["ANY_SENSOR", "TARGETS", "export"]


class Render(Protocol):
    """Text of a parameter file for some axes, at the rate of the target."""

    def __call__(self, axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
        """Text of the file."""


# Name on the command line → the target.
TARGETS: dict[str, Render] = {
    "json": plain_json.render,
    "kalibr": kalibr.render,
    "openvins": openvins.render,
    "matlab": matlab.render,
    "ros": ros.render,
    "vins": vins.render,
    "gtsam": gtsam.render,
    "orbslam3": orbslam3.render,
    "liosam": liosam.render,
    "fastlio": fastlio.render,
    "px4": px4.render,
    "px4-params": px4.render_tabs,
    "ardupilot": ardupilot.render,
    "gazebo": gazebo.render,
    "airsim": airsim.render,
    "kfgins": kfgins.render,
    "gnss-ins-sim": gnss_ins_sim.render,
    "c-header": c_header.render,
    "statespace": statespace.render,
}
#: Targets that take any sensor; the others hold gyroscopes and accelerometers.
ANY_SENSOR = ("json", "c-header", "statespace")
#: Targets whose numbers hold for the rate of the filter, not of the sensor.
OWN_RATE = ("px4", "px4-params", "ardupilot")
#: Simulators, the state space and the variance of a sample: right over a tenth of the recording unless a horizon is given.
WHOLE_RECORD = ("gazebo", "airsim", "gnss-ins-sim", "matlab", "statespace", "ros")


def export(
    axes: Sequence[Axis],
    target: str,
    rate: float | None = None,
    *,
    overbound: bool = False,
    as_fitted: bool = False,
    horizon: float | None = None,
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
        limits up to the horizon. By default they follow the whole model.
    as_fitted : bool
        Whether the coefficients are written as they were fitted, without the other effects.
    horizon : float, optional
        Longest time without aiding, s. Else 100 s, or a tenth of the recording if that is shorter; for a simulator and for
        the state space always a tenth of the recording.
    until : float, optional
        Former name of `horizon`.

    Raises
    ------
    InputError
        Unknown target, options that exclude each other, or a model that lacks what the target needs: any noise, say.
    """
    if target not in TARGETS:
        raise InputError(f"unknown export format {target!r}: one of {', '.join(TARGETS)}")
    from allanite.export._axis import used

    if overbound and as_fitted:
        raise InputError("overbound and as_fitted exclude each other: give one")
    own = [
        used(
            axis,
            None if target in OWN_RATE else rate,
            until if horizon is None else horizon,
            whole_record=target in WHOLE_RECORD,
            as_fitted=as_fitted,
        )
        for axis in axes
    ]
    if target not in ANY_SENSOR:
        _check_one_imu(own, target)
    for axis in own:
        if target not in ANY_SENSOR and not axis.has_noise:
            raise InputError(
                f"{axis.name}: the model {axis.model.name} has no noise: fit one that has"
            )
    return TARGETS[target](own, rate, overbound=overbound)


def _check_one_imu(axes: Sequence[Axis], target: str) -> None:
    """Refuse more than three axes of a sensor: a file holds one IMU."""
    for kind in (ANGULAR_RATE, ACCELERATION):
        names = [axis.name for axis in axes if axis.kind == kind]
        if len(names) > 3:
            raise InputError(
                f"{target} holds one IMU, found {len(names)} axes of {kind} ({', '.join(names)})",
                missing="column",
                remedy=": choose three of them with {column}",
            )

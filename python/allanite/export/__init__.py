"""Parameters of models for filters and simulators, one target per file.

Input: the models of the axes, a rate and a horizon. Output: the text of a parameter file. Add a target as a module
with `render` and `TARGETS` in this folder, in `filters/` or in `simulators/`; modules are found by themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE
from allanite.export._axis import sized
from allanite.export._lines import value_lines
from allanite.export._target import Target, Targets
from allanite.recording.axis_names import AXIS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from typing import Any

    from allanite.export._axis import Axis

__all__ = ["TARGETS", "Target", "export", "export_files", "imus_of", "sized", "value_lines"]

#: Every format by its name on the command line.
TARGETS = Targets("allanite.export", "allanite.export.filters", "allanite.export.simulators")


def export(
    axes: Sequence[Axis],
    target: str,
    rate: float | None = None,
    *,
    overbound: bool = False,
    as_fitted: bool = False,
    horizon: float | None = None,
    until: float | None = None,
    inflate: float = 1.0,
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
        If true, write the fitted N and K and ignore all other effects.
    horizon : float, optional
        Longest time without aiding, s. Else 100 s, or a tenth of the recording if that is shorter; for a simulator and for
        the state space always a tenth of the recording.
    until : float, optional
        Former name of `horizon`.
    inflate : float
        Factor on all deviations, which the file records as the user's choice.

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
            None if TARGETS[target].own_rate else rate,
            until if horizon is None else horizon,
            whole_record=TARGETS[target].whole_record,
            as_fitted=as_fitted,
            inflate=inflate,
        )
        for axis in axes
    ]
    if not TARGETS[target].any_sensor:
        _check_one_imu(own, target)
    for axis in own:
        if not TARGETS[target].any_sensor and not axis.has_noise:
            raise InputError(
                f"{axis.name}: the model {axis.model.name} has no noise: fit one that has"
            )
    return TARGETS[target].render(own, rate, overbound=overbound)


def imus_of(axes: Sequence[Axis]) -> list[list[Axis]]:
    """The axes of each IMU: columns whose names differ in the letter of the axis are one sensor.

    The first gyroscope goes with the first accelerometer, the second with the second, where there are as many of both.
    """
    groups: dict[str, dict[str, list[Axis]]] = {ANGULAR_RATE: {}, ACCELERATION: {}}
    for axis in axes:
        if axis.kind not in groups:
            return [list(axes)]
        groups[axis.kind].setdefault(AXIS.sub("", axis.name), []).append(axis)
    sensors = [list(own.values()) for own in groups.values() if own]
    most = max(sum(map(len, own)) for own in sensors) if sensors else 0
    if most <= 3 or len({len(own) for own in sensors}) > 1:
        return [list(axes)]
    return [[axis for own in each for axis in own] for each in zip(*sensors, strict=True)]


def export_files(
    axes: Sequence[Axis], target: str, path: Path, rate: float | None = None, **how: Any
) -> dict[Path, str]:
    """Text of each file by its path: of several IMUs one each, ``imu-1.yaml``, ``imu-2.yaml``; options as of `export`."""
    groups = [list(axes)] if target in TARGETS and TARGETS[target].any_sensor else imus_of(axes)
    if len(groups) == 1:
        return {path: export(axes, target, rate, **how)}
    return {
        path.with_name(f"{path.stem}-{i}{path.suffix}"): export(own, target, rate, **how)
        for i, own in enumerate(groups, start=1)
    }


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

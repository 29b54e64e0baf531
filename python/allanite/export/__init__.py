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

#: All formats by their name on the command line.
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
        Axes as `allanite.export._axis.axes_of` returns them.
    target : str
        One of `TARGETS`.
    rate : float, optional
        Sampling rate in Hz, for targets with numbers per sample. Default: the rate of the recording.
    overbound : bool
        If true, write the smallest N and K (or N and a Gauss-Markov process) whose density and Allan variance are at least
        the upper limits of the model, up to the horizon. By default, N and K follow the whole model.
    as_fitted : bool
        If true, write the fitted N and K and ignore all other effects.
    horizon : float, optional
        Longest time without aiding, s. Default: 100 s, or a tenth of the recording if that is shorter. For simulators and
        the state space, the default is a tenth of the recording.
    until : float, optional
        Former name of `horizon`.
    inflate : float
        Factor on all deviations. The file states this factor.

    Raises
    ------
    InputError
        The target is unknown, options exclude each other, or the model lacks something that the target needs.
    """
    if target not in TARGETS:
        raise InputError(f"unknown export format {target!r}: choose one of {', '.join(TARGETS)}")
    from allanite.export._axis import used

    if overbound and as_fitted:
        raise InputError("overbound and as_fitted exclude each other: give only one of them")
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
                f"{axis.name}: the model {axis.model.name} has no noise: fit a model with noise, such as N+K"
            )
    return TARGETS[target].render(own, rate, overbound=overbound)


def imus_of(axes: Sequence[Axis]) -> list[list[Axis]]:
    """The axes grouped by IMU. Columns whose names differ only in the letter of the axis are one sensor.

    If there are as many gyroscopes as accelerometers, the first gyroscope belongs to the first accelerometer, and so on.
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
    """Text of each file by its path. Several IMUs get one file each: ``imu-1.yaml``, ``imu-2.yaml``.

    The keyword arguments are those of `export`.
    """
    groups = [list(axes)] if target in TARGETS and TARGETS[target].any_sensor else imus_of(axes)
    if len(groups) == 1:
        return {path: export(axes, target, rate, **how)}
    return {
        path.with_name(f"{path.stem}-{i}{path.suffix}"): export(own, target, rate, **how)
        for i, own in enumerate(groups, start=1)
    }


def _check_one_imu(axes: Sequence[Axis], target: str) -> None:
    """Raise an error for more than three axes of one kind, because a file holds one IMU."""
    for kind in (ANGULAR_RATE, ACCELERATION):
        names = [axis.name for axis in axes if axis.kind == kind]
        if len(names) > 3:
            raise InputError(
                f"{target} holds one IMU, found {len(names)} axes of {kind} ({', '.join(names)})",
                missing="column",
                remedy=": choose three of them with {column}",
            )

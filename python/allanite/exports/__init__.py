"""Parameters of models for filters and simulators.

Input: the models of the axes, a rate and a horizon. Output: the text of a parameter file. A module holds the targets
with one convention: a function for each, and `TARGETS`. Add a target to the module of its convention, or as a new module
in this folder, in `filters/` or in `simulators/`; modules are found by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE
from allanite.exports._axis import (
    Axis,
    axes_of,
    axis_for_export,
    gyro_and_accel_axes,
    rate_of,
)
from allanite.exports._axis_model import model_of_expected_size, warning_of
from allanite.exports._lines import value_lines
from allanite.exports._target import Target, Targets
from allanite.exports._text import verdict_in
from allanite.recording.axis_names import AXIS
from allanite.recording.samples import find_column
from allanite.sources import Source

__all__ = [
    "TARGETS",
    "Axis",
    "Target",
    "axes_named",
    "axes_of",
    "export",
    "export_files",
    "imus_of",
    "model_of_expected_size",
    "rate_of",
    "value_lines",
    "verdict_in",
    "warning_of",
]

#: All formats by their name on the command line.
TARGETS = Targets("allanite.exports", "allanite.exports.filters", "allanite.exports.simulators")


def export(
    model: Source | Axis | Sequence[Source | Axis],
    target: str = "json",
    rate: float | None = None,
    *,
    unit: str | None = None,
    column: str | Sequence[str] | None = None,
    overbound: bool = False,
    as_fitted: bool = False,
    horizon: float | None = None,
    inflate: float = 1.0,
    record_length: float | None = None,
) -> str:
    """Text of a parameter file for a filter or simulator.

    Parameters
    ----------
    model : Model, Fit, Study, Characterization, str, Path, or sequence of them
        A model with values; a result, or its JSON record; a model string, whose values may have units; or a file: a saved
        result, a data sheet (TOML), a YAML file of Kalibr or imu_utils, a MATLAB script with gyroparams, a table of Allan
        deviations. A sequence holds one model for each axis.
    target : str
        ``"kalibr"``, ``"gtsam"``, ``"px4"``, …: a key of `allanite.exports.TARGETS`.
    rate : float, optional
        Sampling rate in Hz, for targets with numbers per sample. Default: the rate of the recording.
    unit : str, optional
        Unit of the samples, if the model does not state it: ``"deg/s"``.
    column : str or sequence of str, optional
        Axes to export. Default: all.
    overbound : bool
        If true, write the smallest N and K (or N and a Gauss-Markov process) whose density and Allan variance are at least
        the upper limits of the model, up to the horizon. By default, N and K follow the whole model.
    as_fitted : bool
        If true, write the fitted N and K and ignore all other effects.
    horizon : float, optional
        Longest time without aiding, s. Default: 100 s, or a tenth of the recording if that is shorter. For simulators and
        the state space, the default is a tenth of the recording.
    inflate : float
        Factor on all deviations. The file states this factor.
    record_length : float, optional
        Length in s of the record from which a table of deviations was computed.

    Returns
    -------
    str

    Raises
    ------
    InputError
        The target is unknown, options exclude each other, or the model lacks something that the target needs.

    Examples
    --------
    >>> import allanite as al
    >>> model = al.AngleRandomWalk(N=1e-4) + al.RateRandomWalk(K=1e-6)
    >>> lines = al.export(model, "kalibr", rate=200, unit="rad/s").splitlines()
    >>> [line.split("  #")[0] for line in lines if line.startswith("gyroscope")]
    ['gyroscope_noise_density: 1.000000e-04', 'gyroscope_random_walk: 1.000000e-06']
    """
    axes = axes_named(axes_of(model, unit, rate=rate, record_length=record_length), column)
    if target not in TARGETS:
        raise InputError(f"unknown export format {target!r}: choose one of {', '.join(TARGETS)}")
    chosen = TARGETS[target]
    if overbound and as_fitted:
        raise InputError("give overbound or as_fitted, not both")
    own = [
        axis_for_export(
            axis,
            None if chosen.own_rate else rate,
            horizon,
            whole_record=chosen.whole_record,
            as_fitted=as_fitted,
            inflate=inflate,
        )
        for axis in axes
    ]
    if not chosen.any_sensor:
        _check_imu(own, chosen)
    return chosen.render(own, rate, overbound=overbound)


def axes_named(axes: Sequence[Axis], column: str | Sequence[str] | None) -> list[Axis]:
    """List of the axes with the given names or indices from 0, in that order; all axes for None or an empty sequence.

    Raises `InputError` for an unknown name or index.
    """
    names = [column] if isinstance(column, str) else column or []
    known = [axis.name for axis in axes]
    return [axes[find_column(name, known)] for name in names] or list(axes)


def imus_of(axes: Sequence[Axis]) -> list[list[Axis]]:
    """List with one list of axes per IMU: the first gyroscope with the first accelerometer, and so on.

    Columns whose names differ only in the letter of the axis belong to one sensor. All axes form one IMU if no kind has
    more than three axes, if the numbers of sensors differ, or if another kind of sensor is present.
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
    """Dict from path to text of each file; nothing is written. Several IMUs get one each: ``imu-1.yaml``, …."""
    groups = [list(axes)] if target in TARGETS and TARGETS[target].any_sensor else imus_of(axes)
    if len(groups) == 1:
        return {path: export(axes, target, rate, **how)}
    return {
        path.with_name(f"{path.stem}-{i}{path.suffix}"): export(own, target, rate, **how)
        for i, own in enumerate(groups, start=1)
    }


def _check_imu(axes: Sequence[Axis], target: Target) -> None:
    """Raise `InputError` unless the axes are those of one IMU that the target can hold, each with noise in its model."""
    for kind in (ANGULAR_RATE, ACCELERATION):
        names = [axis.name for axis in axes if axis.kind == kind]
        if len(names) > 3:
            raise InputError(
                f"{target.name} holds one IMU, found {len(names)} axes of {kind} ({', '.join(names)})",
                missing="column",
                remedy=": choose three of them with {column}",
            )
    if target.both_sensors and not all(gyro_and_accel_axes(axes)):
        raise InputError(
            f"{target.name} needs models of both a gyroscope and an accelerometer: add the missing one"
        )
    for axis in axes:
        if not axis.has_noise:
            raise InputError(
                f"{axis.name}: the model {axis.model.name} has no noise: fit a model with noise, such as N+K"
            )

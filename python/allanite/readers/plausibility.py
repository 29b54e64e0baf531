"""Check a log before anything is computed: no-data markers, repeated samples, units against gravity, motion."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.units import (
    ACCELERATION,
    ANGULAR_RATE,
    conversion,
    is_frequency,
    parse_unit,
    unit_kind,
)
from allanite.readers._table import Table
from allanite.readers.unit_names import usual_units
from allanite.recording import Recording
from allanite.recording.at_rest import motion_error
from allanite.recording.axis_names import axis_triples
from allanite.recording.findings import Finding, names_text
from allanite.recording.sensor_names import sensor_kind

#: Kind of sensor → smallest unit, in SI, whose whole numbers are taken for raw counts: 1 deg/s and 1 m/s². No inertial
#: sensor has so coarse a resolution.
MIN_RAW_COUNT_UNIT = {ANGULAR_RATE: parse_unit("deg/s").scale, ACCELERATION: 1.0}
#: Number of first samples that are tested before all samples.
FIRST_SAMPLES = 1000
#: Maximum relative difference of a mean acceleration from gravity in the unit that is stated: poor accelerometers have
#: scale errors and biases of 6 % (measured on ten recordings). Twice that is allowed. Local gravity differs by 0.3 %.
MAX_STATED_DIFFERENCE = 0.15
#: Maximum relative difference of a mean acceleration from gravity in a unit that is inferred: a scale error of 6 %.
MAX_INFERRED_DIFFERENCE = 0.06
#: Units of acceleration that loggers use.
ACCELERATION_UNITS = ("m/s^2", "g", "mg", "mm/s^2", "ug")
#: The median of a column is computed from at most about this number of samples.
MEDIAN_SAMPLES = 100_000


def checked(recording: Recording, *, for_fit: bool = True, anyway: bool = False) -> Recording:
    """Recording without no-data markers and repeated samples; raises `InputError` if the recording is implausible.

    It is implausible if the mean of accelerometers is gravity in another unit, or, `for_fit`, if it is mostly motion.
    Sensors without a unit are tested in deg/s or m/s². With `anyway`, the audit states the reason instead.
    """
    measured = recording.measured
    doubted = _doubts_of_triads(measured)
    doubts = [_unit_doubt_finding(measured, doubt) for doubt in doubted]
    if anyway:
        return measured.with_findings(doubts)
    if for_fit:
        # Motion is tested in the unit that gravity suggests, and reported first: a corrected unit would not help then.
        likely = {measured.columns[at]: doubt.likely for doubt in doubted for at in doubt.places}
        assumed = assumed_units(measured)
        refusal = motion_error(measured.in_units(assumed | likely))
        if refusal is not None:
            raise (
                refusal
                if not set(assumed) - set(likely)
                else _error_for_assumed_units(refusal, assumed)
            )
    if doubts:
        raise InputError(doubts[0].found, missing="unit", remedy=doubts[0].remedy)
    return measured


def assumed_units(recording: Recording) -> dict[str, str]:
    """Unit by column name that tests of motion assume for sensors without a unit; often empty.

    Gyroscopes are assumed in deg/s (in rad/s their motion would be larger), accelerometers in m/s². Columns of whole
    numbers are raw counts and are left out.
    """
    if not any(finding.kind == "no_unit" for finding in recording.added_findings):
        return {}
    return {
        name: usual_units([name])
        for name, column in zip(recording.columns, recording, strict=True)
        if is_frequency(column.unit)
        and sensor_kind(name) is not None
        and not _are_whole_or_nan(column.samples)
    }


def _are_whole_or_nan(samples: NDArray[Any]) -> bool:
    """True if all samples are whole numbers, infinite or NaN."""
    return bool(np.all((samples == np.round(samples)) | np.isnan(samples)))


def _error_for_assumed_units(refusal: InputError, assumed: Mapping[str, str]) -> InputError:
    """New `InputError` (not raised) that says that `refusal` holds if the unit is the assumed one."""
    units = ",".join(dict.fromkeys(assumed.values()))
    return InputError(
        f"if the unit is {units}: {refusal.found}",
        remedy=f"{refusal.remedy}; add {{unit}} if the unit is another",
    )


def raw_count_findings(recording: Recording, scaled: Collection[str]) -> list[Finding]:
    """One warning for each unit whose columns hold whole numbers, which are probably raw counts.

    Only units of at least 1 deg/s and 1 m/s² count, because logs in mdps or mg may hold whole numbers. Left out are
    columns with one or two adjacent values (a sensor at its resolution), and `scaled` columns.
    """
    found: dict[str, list[str]] = {}
    for name, column in zip(recording.columns, recording, strict=True):
        unit = parse_unit(column.unit)
        if unit.scale < MIN_RAW_COUNT_UNIT.get(unit.kind, np.inf) or name in scaled:
            continue
        x = column.samples
        if not (_are_whole_or_nan(x[:FIRST_SAMPLES]) and _are_whole_or_nan(x)):
            continue
        finite = x[np.isfinite(x)]
        if finite.size and finite.max() - finite.min() > 1.0:
            found.setdefault(column.unit, []).append(name)
    return [
        Finding(
            "raw_counts",
            "warning",
            f"{names_text(names)}: whole numbers of {unit}, probably raw counts",
            values={"count": len(names)},
            remedy=f": give the scale from the data sheet ({{scale}}, {names[0]}=1/131;"
            f" {names[0]}=1 if they are in {unit})",
        )
        for unit, names in found.items()
    ]


@dataclass(frozen=True, slots=True)
class _Doubt:
    """Three accelerometers whose mean is gravity, but in another unit than the stated one."""

    places: tuple[int, ...]
    stated: str | None
    mean: float
    likely: str


def unit_doubts(recording: Recording) -> list[Finding]:
    """A warning for each triad of accelerometers whose mean is gravity in another unit than stated."""
    return [_unit_doubt_finding(recording, doubt) for doubt in _doubts_of_triads(recording)]


def _doubts_of_triads(recording: Recording) -> list[_Doubt]:
    """A `_Doubt` for each triad of accelerometers, with or without a unit, whose mean is gravity in another unit.

    Empty for a single column, and for samples that are no rates.
    """
    if recording.quantity != "rate" or recording.samples.ndim == 1:
        return []
    unitless = any(finding.kind == "no_unit" for finding in recording.added_findings)
    places = [
        at
        for at, (name, unit) in enumerate(zip(recording.columns, recording.units, strict=True))
        if parse_unit(unit).kind == ACCELERATION
        or (unitless and is_frequency(unit) and sensor_kind(name) == ACCELERATION)
    ]
    found = []
    for axes in axis_triples([recording.columns[at] for at in places]):
        own = tuple(places[at] for at in axes)
        unit = recording.units[own[0]]
        stated = None if is_frequency(unit) else unit
        mean = _mean_acceleration([recording.samples[:, at] for at in own])
        likely = _other_unit_by_gravity(mean, stated)
        if likely is not None:
            found.append(_Doubt(own, stated, mean, likely))
    return found


def _mean_acceleration(axes: Sequence[NDArray[Any]]) -> float:
    """Magnitude of the vector of the medians of three columns, in their unit; ignores NaN.

    Long columns are thinned to about 100 000 samples.
    """
    thinned = (x[:: max(1, x.size // MEDIAN_SAMPLES)].astype(np.float64) for x in axes)
    return float(np.linalg.norm([np.nanmedian(x) for x in thinned]))


def _difference_from_gravity(mean: float, unit: str) -> float:
    """Absolute relative difference between a mean acceleration in `unit` and standard gravity."""
    return abs(conversion(unit, "g") * mean - 1.0)


def _other_unit_by_gravity(mean: float, stated: str | None) -> str | None:
    """First of `ACCELERATION_UNITS` in which the mean is gravity within 6 %; None if the `stated` unit fits within 15 %."""
    if stated is not None and _difference_from_gravity(mean, stated) < MAX_STATED_DIFFERENCE:
        return None
    near = (
        u for u in ACCELERATION_UNITS if _difference_from_gravity(mean, u) < MAX_INFERRED_DIFFERENCE
    )
    return next(near, None)


def _unit_doubt_finding(recording: Recording, doubt: _Doubt) -> Finding:
    """Warning about a triad, with the remedy to give the likely unit."""
    names = names_text([recording.columns[at] for at in doubt.places])
    if doubt.stated is None:
        # The remedy also names a unit for gyroscopes without one.
        bare = [
            name
            for name, unit in zip(recording.columns, recording.units, strict=True)
            if is_frequency(unit) and sensor_kind(name) not in (None, ACCELERATION)
        ]
        give = ",".join(filter(None, (usual_units(bare) if bare else "", doubt.likely)))
        found = (
            f"no unit given for {names}: the length of their mean vector, {doubt.mean:.4g}, is"
            f" gravity in {doubt.likely}"
        )
        remedy = f": add {{this_unit:{give}}}, or the true unit"
    else:
        found = (
            f"the stated unit of {names} is {doubt.stated}, but their mean of {doubt.mean:.4g} {doubt.stated} is gravity"
            f" in {doubt.likely}"
        )
        remedy = f": add {{this_unit:{doubt.likely}}}, or {{anyway}} to keep {doubt.stated}"
    return Finding("unit_doubt", "warning", found, values={"mean": doubt.mean}, remedy=remedy)


def without_wrong_units(
    table: Table, given: Mapping[str, str]
) -> tuple[list[str | None], list[Finding]]:
    """Stated unit of each column, or None where gravity shows that it is wrong; and one finding for each such triad.

    A stated unit is wrong if the mean of the accelerometers is gravity in the unit in `given`, by kind of sensor, only.
    """
    units: list[str | None] = list(table.units)
    wanted = given.get(ACCELERATION)
    if wanted is None:
        return units, []
    accels = [
        at
        for at, unit in enumerate(units)
        if unit_kind(unit) == ACCELERATION and table.columns[at] is not None
    ]
    remarks = []
    for axes in axis_triples([table.names[at] for at in accels]):
        own = [accels[at] for at in axes]
        stated = str(units[own[0]])
        mean = _mean_acceleration([table[at] for at in own])
        if parse_unit(stated).name == parse_unit(wanted).name:
            continue
        if _other_unit_by_gravity(mean, stated) == parse_unit(wanted).name:
            names = names_text([table.names[at] for at in own])
            found = (
                f"{names} are read in {wanted} as given, although the log says {stated}: their mean is gravity in"
                f" {wanted}"
            )
            remarks.append(Finding("unit_doubt", "info", found, values={"mean": mean}))
            for at in own:
                units[at] = None
    return units, remarks

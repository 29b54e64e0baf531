"""Decide use, unit and scale of every column of a log, in the same way for all commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.common.unit_kinds import (
    FOREIGN,
    INTEGRAL,
    PHASE,
    RATE,
    kind_of_unit,
    seconds_in,
    time_unit,
)
from allanite.common.units import (
    ACCELERATION,
    ANGULAR_RATE,
    FREQUENCY,
    MAGNETIC_FIELD,
    is_frequency,
    rate_unit,
    unit_kind,
)
from allanite.readers._table import Table, time_unit_of
from allanite.readers.plausibility import without_wrong_units
from allanite.readers.roles import Roles
from allanite.recording import find_column
from allanite.recording.findings import Finding, names_text
from allanite.recording.log_column import LogColumn
from allanite.recording.sensor_names import role_of, sensor_kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.common.read_options import ReadOptions

#: Remedy for a column that is not used.
USE_REMEDY = "; {column} reads a column as a sensor, {logged} as a temperature or another cause"
#: Kind of sensor → name of such a sensor with its article, for messages.
ARTICLES = {
    ANGULAR_RATE: "a gyroscope",
    ACCELERATION: "an accelerometer",
    FREQUENCY: "a clock",
    MAGNETIC_FIELD: "a magnetometer",
}


@dataclass(frozen=True, slots=True)
class Layout:
    """Decision about the columns of a log: which are read, with which units.

    `columns` are all columns, without sampling rates. `samples` and `covariates` are indices. `units` are those of the
    samples in the recording. `time_unit` is None if the header does not state it.
    """

    columns: tuple[LogColumn, ...]
    samples: tuple[int, ...]
    covariates: tuple[int, ...]
    units: tuple[str, ...]
    quantity: str
    roles: Roles
    time_unit: str | None
    findings: tuple[Finding, ...]

    @property
    def used(self) -> tuple[int, ...]:
        """Tuple of the indices of all columns that are read: samples, then covariates, then time, each index once."""
        time = self.roles.time_columns
        return tuple(dict.fromkeys((*self.samples, *self.covariates, *time)))


def layout_of(table: Table, options: ReadOptions) -> Layout:
    """`Layout` of a table, which may hold only the first rows: role, unit, scale and use of every column.

    Raises `InputError` for an unknown column, without a sensor, and if a unit contradicts the header.
    """
    return layout_from_roles(Roles(table, options), options)


def layout_from_roles(found: Roles, options: ReadOptions) -> Layout:
    """`Layout` of a table from the roles of its columns.

    Columns named in the options replace the recognized sensors; named covariates are added to the temperatures. Raises
    `InputError` if no column is a sensor, a column is unknown, or a unit contradicts the given one.
    """
    table, names = found.table, found.table.names
    reasons, loud = list(found.reasons), set[int]()
    if options.columns:
        samples = tuple(dict.fromkeys(find_column(name, names) for name in options.columns))
    else:
        samples = _default_samples(found, options, reasons, loud)
    quantity = options.meaning
    if quantity is None:
        phases = all(kind_of_unit(table.units[i]) == PHASE for i in samples)
        quantity = "angle" if phases and options.unit is None else "rate"
    factors = _factors_of(options.scales, names, samples)
    stated, doubted = without_wrong_units(table, options.unit_by_kind)
    read = {i: _unit_and_scale(names[i], stated[i], options, quantity) for i in samples}
    layout = Layout(
        (),
        samples,
        _covariates(found, options, samples),
        tuple(unit for unit, _ in read.values()),
        quantity,
        found,
        None if found.time is None else _time_unit(found, found.time),
        (),
    )
    scales = {i: scale * factors.get(i, 1.0) for i, (_, scale) in read.items()}
    columns = _log_columns(layout, options, stated, scales, reasons)
    findings = (
        *found.findings,
        *doubted,
        *_phase_unit_findings([columns[i] for i in samples], quantity),
        *([] if options.columns else _findings_about_unused(columns, loud, options)),
    )
    return replace(layout, columns=columns, findings=findings)


def _factors_of(
    scales: Mapping[str, float], names: Sequence[str], samples: Sequence[int]
) -> dict[int, float]:
    """Factor by index of a column from `scales` by name; raises `InputError` if such a column is not in `samples`."""
    found = {}
    for name, factor in scales.items():
        at = find_column(name, names)
        if at not in samples:
            raise InputError(
                f"scale of column {names[at]}: the column is not used",
                remedy="; omit its scale, or select the column with {column}",
            )
        found[at] = factor
    return found


def _covariates(found: Roles, options: ReadOptions, samples: Sequence[int]) -> tuple[int, ...]:
    """Indices of the covariates: temperatures, then requested columns, without the `samples`.

    Temperatures that are text are left out. Raises `InputError` for an unknown requested column.
    """
    table = found.table
    temperatures = [i for i in found.with_role("temperature") if i not in table.texts]
    requested = [find_column(name, table.names) for name in options.covariates]
    return tuple(i for i in dict.fromkeys((*temperatures, *requested)) if i not in samples)


def _log_columns(
    layout: Layout,
    options: ReadOptions,
    stated: Sequence[str | None],
    scales: Mapping[int, float],
    reasons: Sequence[str],
) -> tuple[LogColumn, ...]:
    """All columns of a table as `LogColumn`, with the sources of role, unit and scale; rates are not set.

    `stated` has the unit of each column that the log states, and `reasons` why each column is not used.
    """
    found, used, table = layout.roles, set(layout.used), layout.roles.table
    scaled = {find_column(name, table.names) for name in options.scales}
    columns = []
    for i, (name, unit) in enumerate(zip(table.names, stated, strict=True)):
        role, source = found.roles[i], found.sources[i]
        if i in layout.samples and role != "sensor":
            role, source = "sensor", "option"
        elif i in layout.covariates and role != "temperature":
            source = "option"
        reason = "" if i in used else reasons[i]
        if options.columns and i not in used and role == "sensor":
            reason = "not named as a column to use"
        sources = {"name": table.source if table.named else "guess", "role": source}
        unit, source = _unit_and_source(layout, options, i, unit, role)
        if unit is not None:
            sources["unit"] = source
        scale = scales.get(i, 1.0)
        if scale != 1.0:
            sources["scale"] = "option" if i in scaled else sources["unit"]
        columns.append(LogColumn(name, role, i in used, unit, scale, None, reason, sources))
    return tuple(columns)


def _unit_and_source(
    layout: Layout, options: ReadOptions, at: int, stated: str | None, role: str
) -> tuple[str | None, str]:
    """Pair: unit of the column at index `at` and where it comes from; `stated` is the unit that the log states."""
    found, is_sample = layout.roles, at in layout.samples
    unit = stated
    if role == "time" and unit is None and not (found.parts and at in found.time_columns):
        unit = _time_unit(found, at)
    is_phase = is_sample and layout.quantity != "rate"
    if is_phase and is_frequency(unit) and time_unit(options.unit):
        # A header may state a wrong unit, such as 1; the given unit of time says that the numbers are a phase.
        unit = None
    if unit is not None:
        return unit, "guess" if at in found.time_units else found.table.source
    if not is_sample or options.unit is None:
        return None, ""
    several = "," in options.unit
    return layout.units[layout.samples.index(at)] if several else options.unit, "option"


def _phase_unit_findings(columns: Sequence[LogColumn], quantity: str) -> list[Finding]:
    """At most one warning, about the columns that are read as a phase although they have the unit of a frequency."""
    if quantity == "rate":
        return []
    names = [c.name for c in columns if is_frequency(c.unit)]
    if not names:
        return []
    unit = next(c.unit for c in columns if is_frequency(c.unit))
    return [
        Finding(
            "phase_unit",
            "warning",
            f"{names_text(names)} has unit {unit}, the unit of a fractional frequency, but is read as a phase in s",
            remedy=": leave {quantity:angle} out, or state that the numbers are in s with {this_unit:s}",
        )
    ]


def _time_unit(found: Roles, at: int) -> str | None:
    """Unit of the time column at index `at` if a date, name, unit or guess states it; else None."""
    table = found.table
    if at in table.dates:
        return "s"
    unit = found.time_units.get(at) or time_unit_of(table.names[at], table.units[at])
    if unit == "100us" and table.rate is not None and table.columns[at] is not None:
        # SampleTimeFine of Xsens is in 0.1 ms in MT Manager and in 1 µs in the Movella DOT. The stated rate decides.
        samples = float(np.median(np.diff(table[at]))) * table.rate
        return "us" if abs(samples * 1e-6 - 1.0) < abs(samples * 1e-4 - 1.0) else unit
    return unit


def _default_samples(
    found: Roles, options: ReadOptions, reasons: list[str], loud: set[int]
) -> tuple[int, ...]:
    """Indices, ascending, of the columns that are read as samples if the caller names none.

    Writes why each other sensor is not read into `reasons`, and its index into `loud` if a warning is due. Without a
    unit or quantity in `options`, clock phases are read only if no inertial sensor is logged. Raises `InputError`
    without a sensor. A unit in `options` selects the columns that are named like a sensor of this unit. If there is no
    other sensor, the unit ``1`` selects columns of an unknown unit.
    """
    table, names, units = found.table, found.table.names, found.table.units
    sensors = [i for i in found.with_role("sensor") if i not in found.time_columns]
    foreign = [
        i
        for i, unit in enumerate(units)
        if kind_of_unit(unit) == FOREIGN and role_of(names[i], None) == "sensor"
    ]
    loud.update(i for i in foreign if found.roles[i] == "other")
    for i in foreign:
        reasons[i] = f"the unit {units[i]} is not understood"
    named = {i: sensor_kind(names[i]) for i in sensors}
    kinds = {i: kind_of_unit(units[i]) for i in sensors}

    def only(chosen: list[int], reason: Callable[[int], str]) -> tuple[int, ...]:
        """The `chosen` sensors; writes why each other sensor is not read."""
        for i in sensors:
            if i not in chosen:
                reasons[i] = reason(i)
        return tuple(chosen)

    chosen = [i for i in sensors if named[i] in options.unit_by_kind]
    if chosen:
        # A unit for one kind of sensor selects this kind in a file with gyroscopes and accelerometers.
        loud.update(i for i in sensors if i not in chosen)
        return only(chosen, lambda i: _reason_by_unit(named[i], options.unit))
    if table.named and any(named.values()):
        # Autopilots also log motors, set points and errors without a unit.
        telling = [i for i in sensors if named[i] or kinds[i] is not None]
        sensors = [*only(telling, lambda _: "no unit, and not named like a sensor")]
    inertial = any(named[i] or unit_kind(units[i]) in (ANGULAR_RATE, ACCELERATION) for i in sensors)
    if options.meaning is None:
        phases = [i for i in sensors if kinds[i] == PHASE]
        rates = [i for i in sensors if kinds[i] not in (PHASE, INTEGRAL)]
        if options.unit is None and phases and not inertial:
            return only(phases, lambda _: "the phase of a clock is read instead")
        if rates:
            return only(rates, lambda i: f"its unit {units[i]} is not that of a rate")
    if sensors:
        return tuple(sensors)
    if foreign and options.unit == "1":
        # The caller takes any unit: a series of heights in mm.
        return tuple(foreign)
    raise _no_sensor_error(table, foreign)


def _reason_by_unit(kind: str | None, unit: str | None) -> str:
    """Why a sensor of this kind is not read if `unit`, which the caller gave, is that of another kind."""
    article = ARTICLES.get(kind or "")
    if not article:
        return f"its name does not show that its unit is {unit}"
    return f"{article}, but {unit} is no unit of {article}"


def _no_sensor_error(table: Table, foreign: Sequence[int]) -> InputError:
    """`InputError` (not raised) that no column is a sensor; it names those with a `foreign` unit (indices), or all."""
    if not foreign:
        return InputError(
            f"no sensor column found among {', '.join(table.names) or 'no columns'}",
            missing="column",
            remedy=": select it with {column}",
        )
    units = [table.units[i] or "" for i in foreign]
    shown = ", ".join(f"{table.names[i]} ({table.units[i]})" for i in foreign)
    counter = ", for a counter Hz/10MHz" if any("Hz" in unit for unit in units) else ""
    return InputError(
        f"no sensor column found: {shown} has no unit of a sensor",
        missing="column",
        remedy=": select it with {column} and add {unit}" + counter,
    )


def _findings_about_unused(
    columns: Sequence[LogColumn], loud: set[int], options: ReadOptions
) -> list[Finding]:
    """At most one finding, about the unused columns with reasons; a warning if `loud` is not empty."""
    groups: dict[str, list[str]] = {}
    for i, column in enumerate(columns):
        if not column.used:
            groups.setdefault(column.reason or "not needed", []).append(
                column.name or f"{i} (without a name)"
            )
    if not groups:
        return []
    listed = "; ".join(f"{names_text(names)} ({reason})" for reason, names in groups.items())
    both = (
        "; two units, such as deg/s,m/s^2, read both kinds"
        if loud and len(options.unit_by_kind) == 1
        else ""
    )
    return [
        Finding(
            "not_used",
            "warning" if loud else "info",
            f"not used: {listed}" + both,
            values={"count": sum(map(len, groups.values()))},
            remedy="" if both else USE_REMEDY,
        )
    ]


def _unit_and_scale(
    name: str, own: str | None, options: ReadOptions, quantity: str
) -> tuple[str, float]:
    """Tuple (unit in the recording, factor on the numbers) of a sample column.

    The unit is the given one, or else `own`, which the log states, or else ``"1"``. Phases are converted to s; other
    factors are 1. Raises `InputError` if the given unit contradicts the header, or a phase is read as a rate.
    """
    given = _given_unit(name, own, options)
    if quantity != "rate" and PHASE in (kind_of_unit(own), kind_of_unit(given)):
        stated = own if kind_of_unit(own) == PHASE else given
        assert stated is not None
        same = given is None or given == "1" or time_unit(given) in (time_unit(stated), "s")
        moving = kind_of_unit(own) == RATE and not is_frequency(own)
        if own is not None and (moving or not same):
            raise _unit_contradiction(name, own, given or "")
        return "s", seconds_in(stated)
    if given is None:
        if kind_of_unit(own) == PHASE:
            raise InputError(
                f"column {name} is in {own}, which is no unit of a rate",
                missing="quantity",
                remedy=": if it is the phase of a clock, add {quantity:angle}",
            )
        return own or "1", 1.0
    if own is None:
        return given, 1.0
    try:
        own_rate_unit = rate_unit(own, quantity)
    except InputError:
        return given, 1.0
    if own_rate_unit.name != rate_unit(given, quantity).name:
        raise _unit_contradiction(name, own, given)
    return given, 1.0


def _unit_contradiction(name: str, own: str, given: str) -> InputError:
    """`InputError` (not raised) that the given unit contradicts the unit in the file."""
    return InputError(
        f"the file says that column {name} is in {own}",
        missing="unit",
        remedy=f", but {{this_unit:{given}}} is given: omit it, or convert the results with {{to}}",
    )


def _given_unit(name: str, own: str | None, options: ReadOptions) -> str | None:
    """Unit that the caller gave for the column `name`; None if the caller gave none.

    Of units for several kinds of sensors, the unit `own` that the log states selects one, or else the name. Raises
    `InputError` if neither does; None if `own` is no unit of a sensor.
    """
    if len(options.unit_by_kind) < 2:
        return options.unit
    kind = sensor_kind(name)
    if own is not None:
        try:
            kind = rate_unit(own, options.meaning or "rate").kind
        except InputError:
            return None
    if kind not in options.unit_by_kind:
        raise InputError(
            f"the name of column {name} does not show which of {options.unit} is its unit",
            missing="column",
            remedy=": add a header line that names the sensors, or read the columns of one unit at a time with {column}",
        )
    return options.unit_by_kind[kind]

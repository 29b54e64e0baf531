"""Units in which tables and figures show values: those of data sheets, or those that the user requested."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.printing import REQUESTED_UNITS, table_unit
from allanite.common.units import coefficient_unit, parse_unit
from allanite.effects.registry import standard

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from allanite.common.parameters import Estimate
    from allanite.deviation import Deviation
    from allanite.effects._base import Parameter

#: Units in which data sheets state samples, and the change of a bias with temperature, by kind of sensor.
SAMPLE_UNITS = {"angular rate": "deg/s", "acceleration": "mg"}
#: Coefficient whose unit in data sheets is that of an Allan deviation.
DEVIATION = "B"


@contextmanager
def requested_units(units: Mapping[str, str]) -> Iterator[None]:
    """Context in which tables and figures use these units, by kind of sensor; other kinds have the units of data sheets."""
    token = REQUESTED_UNITS.set(dict(units))
    try:
        yield
    finally:
        REQUESTED_UNITS.reset(token)


def figure_unit(unit: str, *, samples: bool = False) -> str:
    """Unit in which figures show Allan deviations (or samples, with `samples`) of a sensor with samples in `unit`.

    This is the requested unit (`requested_units`). Without a request it is °/h or µg (for samples °/s or mg), and for
    sensors other than gyroscopes and accelerometers `unit`.
    """
    sheet = SAMPLE_UNITS if samples else standard()[DEVIATION].parameter(DEVIATION).sheet
    return table_unit(unit, 0.0, sheet)


def in_figure_unit(deviation: Deviation) -> Deviation:
    """`Deviation` in the unit in which figures and the table of `adev` show it; time deviations are unchanged."""
    if deviation.deviation_unit != deviation.unit:
        return deviation
    return deviation.to(figure_unit(deviation.unit))


def units_of_sheets(parameter: Parameter) -> Mapping[str, str]:
    """Unit by kind of sensor in which data sheets state the coefficient `parameter`; empty if there is none.

    It is the one that the parameter declares, or that of the coefficient among Q, N, B, K and R with the same power of
    seconds: an amplitude is in °/h like B.
    """
    if not isinstance(parameter.unit, float):
        return {}
    declared = (p for name, e in standard().items() for p in (e.parameter(name),))
    return parameter.sheet or next((p.sheet for p in declared if p.unit == parameter.unit), {})


def sheet_unit(parameter: Parameter, sample: str) -> str:
    """Unit of a parameter as in data sheets, such as °/√h for N, or as requested; `sample` is the unit of the samples.

    A unit that does not depend on the samples, such as Hz, is returned unchanged.
    """
    power = parameter.unit
    if not isinstance(power, float):
        return power
    return table_unit(sample, power, units_of_sheets(parameter))


def in_sheet_unit(value: Estimate, parameter: Parameter) -> Estimate:
    """`Estimate` of a fitted `parameter`, converted to the unit in which tables and figures show it.

    A coefficient gets its unit in data sheets (`sheet_unit`). A change per unit of a logged column is in °/s or mg, or
    in the requested unit, per unit of the column. Any other estimate is returned unchanged, as is a change whose unit
    is unknown.
    """
    if isinstance(parameter.unit, float):
        sample = value.unit.removesuffix(coefficient_unit("", parameter.unit))
        return value.to(sheet_unit(parameter, sample))
    if not parameter.unit.startswith("U/"):
        return value
    pieces = value.unit.split("/")
    for k in range(1, len(pieces)):
        # The unit of the samples may itself contain a slash: deg/s/°C.
        sample = "/".join(pieces[:k])
        try:
            kind = parse_unit(sample).kind
        except InputError:
            continue
        unit = REQUESTED_UNITS.get().get(kind) or SAMPLE_UNITS.get(kind, sample)
        return value.to(unit + value.unit[len(sample) :])
    return value

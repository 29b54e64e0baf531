"""Units in which figures show values: those of data sheets, or those that the user requested."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.printing import REQUESTED_UNITS, table_unit, to_sheet_unit
from allanite.common.units import conversion, parse_unit
from allanite.effects import standard

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from allanite.common.parameters import Estimate
    from allanite.effects import Parameter

#: Units in which data sheets state samples, and the change of a bias with temperature, by kind of sensor.
SAMPLE_UNITS = {"angular rate": "deg/s", "acceleration": "mg"}
#: Coefficient whose unit in data sheets is that of an Allan deviation.
DEVIATION = "B"


@contextmanager
def requested_units(units: Mapping[str, str]) -> Iterator[None]:
    """Context in which figures use these units, by kind of sensor; other kinds have the units of data sheets."""
    token = REQUESTED_UNITS.set(dict(units))
    try:
        yield
    finally:
        REQUESTED_UNITS.reset(token)


def figure_unit(unit: str, *, samples: bool = False) -> str:
    """Unit in which figures show deviations, or `samples`, of a sensor whose samples are in `unit`.

    A requested unit comes first, then that of data sheets (°/h, µg), or for samples °/s and mg. Other kinds keep
    `unit`.
    """
    sheet = SAMPLE_UNITS if samples else standard()[DEVIATION].parameter(DEVIATION).sheet
    return table_unit(unit, 0.0, sheet)


def factor_to_figure_unit(unit: str) -> float:
    """Factor from a deviation in `unit` to the unit in which figures show it."""
    return conversion(unit, figure_unit(unit))


def in_sheet_unit(value: Estimate, parameter: Parameter) -> Estimate:
    """`Estimate` in the unit of data sheets; unchanged if there is none.

    A parameter without a unit of data sheets gets that of the standard coefficient with the same power of seconds: an
    amplitude or σ is in °/h like B, the driving noise of a Gauss-Markov process in °/h/√h like K. A change with a
    logged column is in `SAMPLE_UNITS` per unit of the column.
    """
    if isinstance(parameter.unit, float):
        declared = (p for name, e in standard().items() for p in (e.parameter(name),))
        alike = (p.sheet for p in declared if p.unit == parameter.unit)
        return to_sheet_unit(value, parameter.sheet or next(alike, {}))
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

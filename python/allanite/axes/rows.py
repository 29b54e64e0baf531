"""Parameters of the axes of a sensor as rows of text: one row for each parameter, one cell for each column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.axes.forms import labels_of
from allanite.common.numbers import number, value_and_interval_text
from allanite.common.parameters import Estimate
from allanite.common.printing import printed, relative_unit
from allanite.common.units import ACCELERATION, ANGULAR_RATE, SI_UNITS, parse_unit
from allanite.effects.sheet_units import in_sheet_unit, sheet_unit

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from allanite.effects import Effect, Parameter
    from allanite.fit.result import Fit
    from allanite.study import Study

#: Kinds of inertial sensors.
INERTIAL = (ANGULAR_RATE, ACCELERATION)
#: (Label of a parameter, kind of sensor) → additional unit in the table, which data sheets use.
FURTHER_UNITS = {("N", ACCELERATION): "ug/sqrt(Hz)"}
#: Cell of a parameter that the model of an axis does not have.
ABSENT = "–"


@dataclass(frozen=True, slots=True)
class Row:
    """Row of a table: a label, and one text per axis."""

    label: str
    cells: tuple[str, ...]


def rows(studies: Mapping[str, Study]) -> list[Row]:
    """Rows of the table of axes, each with one text per study.

    The first row has the names of the models. Each parameter follows, in the unit of data sheets with its interval,
    then in other units without. The last two rows are δ, the model discrepancy in %, and the verdict.
    """
    fits = [study.fit for study in studies.values()]
    out = [Row("model", tuple(fit.model.name for fit in fits))]
    labels = labels_of([fit.model for fit in fits])
    labeled = [dict(_cells_of(fit, own)) for fit, own in zip(fits, labels, strict=True)]
    for label in dict.fromkeys(name for table in labeled for name in table):
        out += _parameter_rows(label, [table.get(label) for table in labeled], fits)
    out.append(Row("δ", tuple(_discrepancy_text(fit) for fit in fits)))
    out.append(Row("verdict", tuple(study.verdict for study in studies.values())))
    return out


def legend(studies: Mapping[str, Study]) -> str:
    """Text with the names of all effects in the models: ``N angle random walk, B bias instability``."""
    names = {e.short: s.fit.display_name(e) for s in studies.values() for e in s.fit.model}
    return ", ".join(f"{short} {name}" for short, name in names.items())


def convention(fits: Iterable[Fit]) -> str:
    """Text of sentences on how coefficients compare with data-sheet values; empty without gyroscopes or accelerometers."""
    inertial = (fit for fit in fits if parse_unit(fit.recording.unit).kind in INERTIAL)
    remarks = dict.fromkeys(effect.on_sheets for fit in inertial for effect in fit.model)
    return "; ".join(filter(None, remarks))


#: Effect, parameter and its estimate.
_Cell = tuple["Effect", "Parameter", Any]


def _cells_of(fit: Fit, labels: Sequence[str]) -> Iterator[tuple[str, _Cell]]:
    """Yield (row label, (effect, parameter, estimate)) for each fitted parameter that the table of axes shows.

    A row label is ``N``, or effect label and parameter such as ``GM sigma``. Effects of one kind follow each other.
    """
    kinds = [effect.kind for effect in fit.model]
    labeled_effects = zip(fit.model, fit.estimates, labels, strict=True)
    ordered = sorted(
        labeled_effects, key=lambda one: (kinds.index(one[0].kind), len(one[2]), one[2])
    )
    for effect, values, label in ordered:
        for name in effect.shown():
            value = values.get(name)
            if isinstance(value, Estimate):
                parameter = effect.parameter(name)
                key = name if name == label else f"{label} {parameter.symbol or name}"
                yield key, (effect, parameter, value)


def _parameter_rows(label: str, cells: Sequence[_Cell | None], fits: Sequence[Fit]) -> list[Row]:
    """Rows of the table of axes for one parameter, one for each unit in which it is shown.

    `cells` has one entry per axis, None where the axis lacks the parameter. The first row is in the data-sheet unit,
    with intervals. If the units of the axes cannot be converted (such as per °C), each unit has its own row, with
    intervals, for the axes with this unit.
    """
    unit = fits[0].recording.unit
    kind = parse_unit(unit).kind
    parameter = next(cell[1] for cell in cells if cell is not None)
    power = parameter.unit
    if not isinstance(power, float):
        cells = [None if c is None else (*c[:2], in_sheet_unit(c[2], c[1])) for c in cells]
        # Units that cannot be converted (per °C; a fitted power) get a row each.
        own = {cell[2].unit: cell[0].follows or "" for cell in cells if cell is not None}
        return [
            Row(
                f"{label}  {'' if unit == '1' else printed(unit, follows)}".rstrip(),
                tuple(
                    _cell_text(c if c is not None and c[2].unit == unit else None) for c in cells
                ),
            )
            for unit, follows in own.items()
        ]
    units = [sheet_unit(parameter, unit)]
    if (label, kind) in FURTHER_UNITS:
        units.append(FURTHER_UNITS[label, kind])
    if kind in INERTIAL:
        units.append(relative_unit(SI_UNITS[kind], power))
    out = []
    for i, target in enumerate(dict.fromkeys(units)):
        texts = tuple(_cell_text(cell, target, interval=i == 0) for cell in cells)
        head = label if i == 0 else " " * len(label)
        out.append(Row(f"{head}  {printed(target)}", texts))
    return out


def _cell_text(cell: _Cell | None, unit: str | None = None, *, interval: bool = True) -> str:
    """Text of an entry in the table of axes, without its unit: value and 95 % interval, in `unit` if given.

    A parameter that was not detected gives ``< limit``, or a dash without an interval; None also gives a dash. A value
    without an interval has four digits, and the reason in brackets if it was not fitted. With `interval` False,
    detected values have four digits only.
    """
    if cell is None:
        return ABSENT
    effect, parameter, value = cell
    value = value if unit is None else value.to(unit)
    if not value.detected:
        return ABSENT if value.interval is None else f"< {number(value.limit, 3)}"
    if not interval or value.interval is None:
        kept = effect.kept(parameter.name) if interval else ""
        return number(float(value), 4) + (f" ({kept})" if kept else "")
    return value_and_interval_text(float(value), value.interval)


def _discrepancy_text(fit: Fit) -> str:
    """Text such as ``0.5 % (0.1 … 0.9)``: model discrepancy of a fit, in % of the deviation, with its 95 % interval."""
    found = fit.discrepancy
    low, high = found.interval
    return f"{number(found.percent, 2)} % ({low:.2g} … {high:.2g})"

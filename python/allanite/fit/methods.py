"""Compare the Whittle likelihood with GLS on the Allan variance and with straight lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.common.documents import fields_dict
from allanite.common.errors import AllaniteError
from allanite.common.numbers import number
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines
from allanite.common.units import coefficient_unit
from allanite.deviation import oadev
from allanite.effects import Parameter, Stochastic, find, standard
from allanite.effects.sheet_units import in_sheet_unit
from allanite.fit.classical.lines import LineReading, LineReadings, read_lines
from allanite.fit.classical.refit import refit
from allanite.fit.fitting import fit_model
from allanite.fit.table import estimate_cell

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.fit.result import Fit
    from allanite.plots.spec import Figure

#: Name of each method at the head of its column, in the order of `METHODS`.
METHOD_NAMES = ("spectrum (whittle)", "Allan curve (gls)", "straight lines (lines)")


@dataclass(frozen=True, slots=True)
class MethodRow:
    """One coefficient, such as ``N`` or ``GM.q_c``, estimated by three methods.

    `whittle`, `gls` and `line` are None if the method does not estimate the coefficient. `remark` says why the line reading
    misleads; empty if it does not.
    """

    name: str
    unit: str
    whittle: Estimate | None
    gls: Estimate | None
    line: LineReading | None
    remark: str

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON; the key ``misleads`` is True if there is a remark. A method without a value is None."""
        return fields_dict(self, line="lines") | {"misleads": bool(self.remark)}


@dataclass(frozen=True, slots=True, eq=False)
class MethodTable:
    """A Whittle fit with its coefficients by all three methods.

    `rows` are those of the random effects, then lines on the curve for which the model has no effect.
    """

    fit: Fit
    rows: tuple[MethodRow, ...]

    def __getitem__(self, name: str) -> MethodRow:
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"no coefficient {name!r}: {', '.join(r.name for r in self.rows)}")

    def to_dict(self) -> dict[str, Any]:
        """Dict of the fit (see `Fit.to_dict`) with ``methods``, a list with one entry for each coefficient."""
        return {**self.fit.to_dict(), "methods": [row.to_dict() for row in self.rows]}

    def plot(self, path: str | Path | None = None) -> Figure:
        """Figure of the fit, written to `path` if given; see `Fit.plot`."""
        return self.fit.plot(path)

    def __str__(self) -> str:
        table = [("", "", *METHOD_NAMES, "lines read at")]
        for row in self.rows:
            line, unit = row.line, _in_table_unit(row.name, Estimate(1.0, unit=row.unit)).unit
            read, where = "–" if line is None else "not valid", ""
            if line is not None and line.present:
                read = _cell(row.name, line.estimate(row.unit))
                where = f"slope holds {line.tau_low_s:.3g}–{line.tau_high_s:.3g} s"
            by_likelihood, by_gls = (_cell(row.name, each) for each in (row.whittle, row.gls))
            printed_unit = "" if unit == "1" else printed(unit)
            table.append((row.name, printed_unit, by_likelihood, by_gls, read, where))
        remarks = [f"! {row.name}: {row.remark}" for row in self.rows if row.remark]
        return "\n".join(
            [str(self.fit), "", *aligned_lines(table), *([""] if remarks else []), *remarks]
        )


def _in_table_unit(name: str, estimate: Estimate) -> Estimate:
    """`Estimate` of the coefficient `name`, such as ``N`` or ``GM.sigma``, in the unit in which tables show it."""
    short, _, own = name.partition(".")
    effect = find(short)
    return estimate if effect is None else in_sheet_unit(estimate, effect.parameter(own or name))


def _cell(name: str, estimate: Estimate | None) -> str:
    """Table cell of the coefficient `name` in the unit of tables (see `estimate_cell`); "–" for None."""
    return "–" if estimate is None else estimate_cell(_in_table_unit(name, estimate))


def compare_methods(fit: Fit) -> MethodTable:
    """`MethodTable` of the coefficients of a fit by the Whittle likelihood, GLS and straight lines.

    A fit by another method is first repeated by the Whittle likelihood. GLS is omitted if it cannot be used, e.g. with held
    values. Effects without a coefficient have no row.
    """
    base = fit if fit.method == "whittle" else fit_model(fit.recording, fit.model)
    try:
        gls: Fit | None = refit(base, "gls")
    except AllaniteError:
        # Held values, or too few averaging factors for so many effects.
        gls = None
    readings = read_lines(oadev(base.data.samples, rate=base.data.rate, taus=8))
    rows = []
    modeled = set()
    for place, effect in enumerate(base.model.effects):
        kind = None if effect.standard is None else effect.standard.name
        own = effect.coefficient if isinstance(effect, Stochastic) else kind
        if own is None:
            continue
        whittle = base.estimates[place][own]
        least = gls.estimates[place][own] if gls and isinstance(effect, Stochastic) else None
        line = readings[kind] if kind is not None else None
        modeled.add(kind)
        remark = "" if line is None else _remark(whittle, line, effect.parameter(own))
        name = own if kind is not None else f"{effect.short}.{own}"
        rows.append(MethodRow(name, whittle.unit, whittle, least, line, remark))
    return MethodTable(base, (*rows, *_lines_without_effect(readings, base, modeled)))


def _lines_without_effect(
    readings: LineReadings, fit: Fit, modeled: set[str | None]
) -> list[MethodRow]:
    """List of rows, with remarks, for straight lines on the Allan curve whose names are not `modeled`.

    A line that cannot be read has a row only if its slope holds somewhere, but the curve falls below it elsewhere.
    """
    unit = fit.recording.unit
    others = " + ".join(e.short for e in fit.model)
    out = []
    for line in readings.lines:
        if line.name in modeled:
            continue
        refused = line.value is None and "lies below its line" in line.reason
        if line.value is None and not refused:
            continue
        effect = standard()[line.name]
        name = effect.kind.replace("_", " ")
        if refused:
            remark = f"no {name} is read: {line.reason}"
        elif fit.adequate:
            remark = f"{others} explains this part of the curve without {name}"
        else:
            remark = f"the model is not adequate and has no {name}: try adding {name}"
        power = effect.parameter(line.name).unit
        assert not isinstance(power, str)
        out.append(MethodRow(line.name, coefficient_unit(unit, power), None, None, line, remark))
    return out


def _remark(whittle: Estimate, line: LineReading, parameter: Parameter) -> str:
    """Remark how the line reading contradicts the Whittle estimate; empty text if it does not.

    They contradict if their intervals do not overlap, or if no line can be read for a detected parameter.
    """
    low, high = whittle.interval or (float(whittle), float(whittle))
    low, high = sorted((abs(low), abs(high)))
    if line.value is None or line.low is None or line.high is None:
        text = f"no line can be read, but the fit detects it: {line.reason}"
        return text if whittle.detected else ""
    if not whittle.detected and line.low > high:
        unit = whittle.unit
        read, most = (in_sheet_unit(Estimate(v, unit=unit), parameter) for v in (line.value, high))
        shown = "" if read.unit == "1" else f" {printed(read.unit)}"
        return f"the line reads {number(read.value)}{shown}, the whole spectrum allows at most {number(most.value)}{shown}"
    if whittle.detected and (line.low > high or line.high < low):
        percent = 100.0 * (line.value / abs(float(whittle)) - 1.0)
        return f"the line is off by {percent:+.0f} % from the fit: other effects contribute to this part of the curve"
    return ""

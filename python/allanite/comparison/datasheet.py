"""What a measurement says to the figures of a data sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from allanite.common.parameters import Estimate
from allanite.common.units import parse_unit
from allanite.sources.datasheet import MINIMUM, DataSheet, Quoted, read_datasheet
from allanite.sources.slips import slip

__all__ = ["Comparison", "DataSheet", "Quoted", "compare_datasheet", "read_datasheet"]

SOLID = 10  # degrees of freedom from which a point of the Allan curve may be its minimum


@dataclass(frozen=True, slots=True)
class Row:
    """A figure beside its measurement, both in the canonical unit of the coefficient."""

    figure: Quoted
    sheet: float
    measured: Estimate
    ratio: Estimate
    remark: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """Measured coefficients over a data sheet's figures."""

    sheet: DataSheet
    column: str
    rows: tuple[Row, ...]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """``allanite/datasheet/1``."""
        return {
            "schema": "allanite/datasheet/1",
            "name": self.sheet.name,
            "column": self.column,
            "figures": [
                {
                    "figure": row.figure.name,
                    "value": row.figure.value,
                    "unit": row.figure.unit,
                    "coefficient": row.figure.coefficient,
                    "sheet": {"value": row.sheet, "unit": row.measured.unit},
                    "measured": row.measured.to_dict(),
                    "ratio": row.ratio.to_dict(),
                    "remark": row.remark or None,
                }
                for row in self.rows
            ],
            "remarks": list(self.remarks),
        }

    def __str__(self) -> str:
        cells = [("figure", "data sheet", "measured", "measured / sheet")]
        cells += [
            (
                row.figure.name,
                f"{row.figure.value:g} {row.figure.unit}",
                f"{_in_its_unit(row):.4g}" if row.measured.detected else "not detected",
                _ratio(row.ratio),
            )
            for row in self.rows
        ]
        widths = [max(len(row[i]) for row in cells) for i in range(4)]
        lines = [f"{self.column} against {self.sheet.name}"]
        lines += ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in cells]
        remarks = [f"! {row.figure.name}: {row.remark}" for row in self.rows if row.remark]
        return "\n".join([*lines, *remarks, *(f"! {remark}" for remark in self.remarks)])


def _in_its_unit(row: Row) -> float:
    """Return the measured value as the sheet would print it."""
    return row.measured.value * row.figure.value / row.sheet if row.sheet else math.nan


def _ratio(ratio: Estimate) -> str:
    if not ratio.detected:
        return f"< {ratio.interval[1]:.3g}" if ratio.interval else "?"
    if ratio.interval is None:
        return f"{ratio.value:.3g}"
    return f"{ratio.value:.3g} ({ratio.interval[0]:.3g} … {ratio.interval[1]:.3g})"


def compare_datasheet(fit: Any, sheet: DataSheet) -> Comparison:
    r"""Compare a fit with a sheet: the ratio of each figure, and the suspicious ones named.

    Parameters
    ----------
    fit : Fit
        Of a model that has the sheet's coefficients.
    sheet : DataSheet

    Returns
    -------
    Comparison
        Of each figure the measured coefficient, in the unit of the recording, and its ratio to the sheet's.

    Raises
    ------
    InputError
        A figure of another kind of sensor.

    Examples
    --------
    >>> with open("sheet.toml", "w", encoding="utf-8") as file:
    ...     _ = file.write("[figures]\nnoise_density = '0.03 deg/s/sqrt(Hz)'\n")
    >>> log = al.AngleRandomWalk(N=0.03 / 2**0.5).simulate(duration=600, rate=50, seed=1, unit="deg/s")
    >>> found = al.compare_datasheet(al.AngleRandomWalk().fit(log), al.read_datasheet("sheet.toml"))
    >>> low, high = found.rows[0].ratio.interval
    >>> bool(low < 1.0 < high)
    True
    """
    unit = parse_unit(fit.recording.unit).name
    rows = []
    missing = []
    for figure in sheet.figures:
        expected = figure.in_unit(unit)
        try:
            minimal = figure.coefficient == MINIMUM
            measured = _minimum(fit.recording) if minimal else fit[figure.coefficient]
        except KeyError:
            missing.append(figure.name)
            continue
        ratio = Estimate(
            measured.value / expected,
            None if measured.std_error is None else measured.std_error / expected,
            _scaled(measured.interval, 1 / expected),
            "1",
            measured.detected,
            f"{figure.name} ratio",
        )
        remark = _remark(figure, ratio) or _skipped(figure, ratio, sheet, fit.recording)
        rows.append(Row(figure, expected, measured, ratio, remark))
    remarks = sheet.remarks()
    if missing:
        remarks.append(f"the model has no coefficient for {', '.join(missing)}: fit one that does")
    if not getattr(fit, "adequate", True):
        remarks.append(
            f"{fit.model.name} does not describe this record (see allanite check): B and K may"
            " stand for what it lacks"
        )
    return Comparison(sheet, fit.recording.columns[0], tuple(rows), tuple(remarks))


def _scaled(interval: tuple[float, float] | None, factor: float) -> tuple[float, float] | None:
    return None if interval is None else (interval[0] * factor, interval[1] * factor)


def _minimum(recording: Any) -> Estimate:
    """Lowest point of the Allan deviation among those that are well known."""
    from allanite.deviation import oadev

    curve = oadev(recording, taus=12)
    at = min(
        (i for i in range(len(curve.tau)) if curve.edf[i] >= SOLID),
        key=lambda i: curve.deviation[i],
        default=0,
    )
    low, high = float(curve.low[at]), float(curve.high[at])
    value = float(curve.deviation[at])
    return Estimate(value, (high - low) / 4, (low, high), recording.unit, name=MINIMUM)


def _remark(figure: Quoted, ratio: Estimate) -> str:
    if not ratio.detected:
        return ""
    return slip(figure.coefficient, ratio.value, _tolerance(ratio))


def _tolerance(ratio: Estimate) -> float:
    width = 3 * (ratio.std_error or 0.0) / ratio.value if ratio.value > 0 else 0.0
    return max(width, 0.05)


def _skipped(figure: Quoted, ratio: Estimate, sheet: DataSheet, recording: Any) -> str:
    """Whether the white level is that of samples thinned by skipping: alone it cannot be seen, white stays white."""
    if (
        figure.coefficient != "N"
        or not ratio.detected
        or not (sheet.bandwidth or sheet.sample_rate)
    ):
        return ""
    folded = sheet.folded(recording.rate)
    slack = math.exp(min(_tolerance(ratio), 0.1))
    if folded is None or not folded[0] / slack <= ratio.value <= folded[1] * slack:
        return ""
    return (
        f"looks as if samples were skipped on the way to {recording.rate:g} Hz: the noise above half of that is folded"
        f" down and raises N by {folded[0]:.3g}"
        + (f" to {folded[1]:.3g}" if folded[1] > 1.001 * folded[0] else "")
        + "; log faster and average"
    )

"""Comparison of fitted coefficients with the figures of a data sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import number
from allanite.common.parameters import Estimate, scaled_estimate
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines
from allanite.common.units import parse_unit
from allanite.effects import Model, Stochastic, find
from allanite.recording import Recording
from allanite.sources.datasheet import MINIMUM, DataSheet, Quoted
from allanite.sources.slips import mistake_text

if TYPE_CHECKING:
    from allanite.fit import Fit

#: Points of the Allan curve with fewer degrees of freedom are not used as its minimum. At 40 degrees of freedom, the
#: upper end of the 95 % interval is 1.23 times the deviation (chi-squared).
EDF_OF_MINIMUM = 40.0


@dataclass(frozen=True, slots=True)
class Row:
    """Figure of a data sheet, measured coefficient and their ratio; `sheet` and `measured` are in the recording's units."""

    figure: Quoted
    sheet: float
    measured: Estimate
    ratio: Estimate
    remark: str

    @property
    def texts(self) -> tuple[str, str, str]:
        """Texts of the sheet's value, the measured value, and their ratio: ``1.02 (0.98 … 1.06)`` or ``< 1.06``."""
        ratio, interval = number(self.ratio.value), self.ratio.interval
        if not self.ratio.detected:
            ratio = f"< {number(self.ratio.limit)}" if interval else "?"
        elif interval is not None:
            ratio = f"{ratio} ({number(interval[0])} … {number(interval[1])})"
        value = self.ratio.value * self.figure.value if self.measured.detected else None
        sheet = f"{number(self.figure.value, 6)} {printed(self.figure.unit)}"
        return sheet, measured_text(self.figure, value), ratio


@dataclass(frozen=True, slots=True)
class Comparison:
    """Ratios of measured coefficients to the figures of a data sheet, one `Row` per figure, and remarks."""

    sheet: DataSheet
    column: str
    rows: tuple[Row, ...]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/datasheet/1``: stated and measured value of each figure, and remarks."""
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
        cells += [(row.figure.name, *row.texts) for row in self.rows]
        lines = [f"{self.column} compared with {self.sheet.name}"]
        lines += [f"  {line}" for line in aligned_lines(cells)]
        remarks = [f"! {row.figure.name}: {row.remark}" for row in self.rows if row.remark]
        return "\n".join([*lines, *remarks, *(f"! {remark}" for remark in self.remarks)])


def measured_text(figure: Quoted, value: float | None) -> str:
    """Text of a measured value with the unit that the sheet prints, or ``not detected``.

    The minimum of an Allan deviation that still falls at the longest τ is ``not reached``.
    """
    if value is not None:
        return f"{number(value, 4)} {printed(figure.unit)}"
    return "not reached" if figure.coefficient == MINIMUM else "not detected"


def compare_datasheet(fit: Fit, sheet: DataSheet) -> Comparison:
    r"""`Comparison` of a fit with a data sheet, with remarks on ratios that are typical of a mistake with units.

    Parameters
    ----------
    fit : Fit
        Fit of a model that has the coefficients of the sheet.
    sheet : DataSheet

    Returns
    -------
    Comparison
        For each figure whose coefficient the model has, the measured coefficient, in the unit of the recording, and its
        ratio to the figure. Remarks name the other figures.

    Raises
    ------
    InputError
        A figure is for another kind of sensor.

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
        measured = measured_figure(figure, fit)
        if measured is None:
            missing.append(figure.name)
            continue
        ratio = scaled_estimate(measured, 1 / expected, "1")
        remark = _remark_on_unit(figure, ratio) or _remark_on_skipped_samples(
            figure, ratio, sheet, fit.recording.rate
        )
        rows.append(Row(figure, expected, measured, ratio, remark))
    remarks = sheet.remarks()
    if missing:
        remarks.append(
            f"the model has no coefficient for {', '.join(missing)}: fit a model that has one"
        )
    if not getattr(fit, "adequate", True):
        remarks.append(
            f"{fit.model.name} does not describe this record (see allanite check): B and K may be"
            " too large, because they include missing effects"
        )
    return Comparison(sheet, fit.recording.columns[0], tuple(rows), tuple(remarks))


def with_figures(model: Model, sheet: DataSheet) -> Model:
    """Copy (`Model`) of `model` with an added effect, without values, for each coefficient of the sheet that it lacks."""
    present = {effect.kind for effect in model}
    for name in dict.fromkeys(figure.coefficient for figure in sheet.figures):
        effect = find(name.partition(".")[0])
        if effect is not None and effect.kind not in present:
            model = model + effect()
            present.add(effect.kind)
    return model


def measured_figure(figure: Quoted, fit: Fit) -> Estimate | None:
    """The quantity that a data sheet states, a coefficient or the minimum of the Allan deviation, from a fit.

    None if the fitted model lacks this coefficient.
    """
    if figure.coefficient == MINIMUM:
        return allan_minimum(fit)
    try:
        return fit[figure.coefficient]
    except KeyError:
        return None


def allan_minimum(fit: Fit) -> Estimate:
    """Minimum of the Allan deviation over τ, in the unit of the recording, with its 95 % interval.

    The value is the measured deviation at the τ where the fitted model is lowest. Only τ with at least 40 degrees of
    freedom are considered, if there are any. The upper end is the upper limit of this measured point. The lower end is
    the minimum of the fitted curve with coefficients at their lower limits. If no slow noise was detected, the curve
    still falls at the end of the record. Then the lower end is 0, and the minimum counts as not detected.
    """
    recording = fit.recording
    curve = recording.oadev(taus=12) if isinstance(recording, Recording) else recording.oadev()
    solid = curve.edf >= min(EDF_OF_MINIMUM, float(curve.edf.max()))
    tau = curve.tau[solid]
    model = fit.model.allan_variance(tau, rate=recording.rate)
    at = int(np.argmin(model))
    value, high = float(curve.deviation[solid][at]), float(curve.high[solid][at])
    low = _lowest_deviation(fit)
    shown = low > 0.0
    return Estimate(
        value, (high - low) / 4 if shown else None, (low, high), recording.unit, shown, MINIMUM
    )


def _lowest_deviation(fit: Fit) -> float:
    """Minimum over τ of the Allan deviation of the detected random effects, with coefficients at their lower limits.

    0 if no effect has a positive lower limit, or if the deviation still falls at 1000 times the length of the record.
    """
    effects = []
    for effect, estimates in zip(fit.model, fit.estimates, strict=True):
        if isinstance(effect, Stochastic):
            own = estimates[effect.coefficient]
            if own.detected and own.interval is not None and own.interval[0] > 0.0:
                effects.append(effect.with_values(**{effect.coefficient: own.interval[0]}))
    rate = fit.recording.rate
    # Flicker noise levels off and white noise decreases forever: times up to 1000 record lengths distinguish them.
    tau = np.geomspace(1.0 / rate, 1000.0 * fit.recording.duration, 400)
    m = np.unique(np.round(tau * rate))
    if not effects:
        return 0.0
    variance = Model(tuple(effects)).allan_variance(m / rate, rate=rate)
    at = int(np.argmin(variance))
    return (
        0.0
        if at == len(m) - 1 and variance[-2] > 1.001 * variance[-1]
        else float(np.sqrt(variance[at]))
    )


def _remark_on_unit(figure: Quoted, ratio: Estimate) -> str:
    """The typical mistake with units by which measured value and data sheet differ; empty if there is none.

    `ratio` is measured over stated value.
    """
    if not ratio.detected:
        return ""
    return mistake_text(figure.coefficient, ratio.value, _log_ratio_tolerance(ratio))


def _log_ratio_tolerance(ratio: Estimate) -> float:
    """Tolerance of ln(ratio): three standard errors of ln(ratio), at least 0.05."""
    width = 3 * (ratio.std_error or 0.0) / ratio.value if ratio.value > 0 else 0.0
    return max(width, 0.05)


def _remark_on_skipped_samples(
    figure: Quoted, ratio: Estimate, sheet: DataSheet, rate: float
) -> str:
    """Remark that samples seem to have been skipped, if aliasing explains the ratio of N; else empty.

    Skipping raises N by a factor that follows from the bandwidth or rate in the sheet. The log alone cannot show this,
    because skipping samples of white noise leaves white noise.
    """
    if (
        figure.coefficient != "N"
        or not ratio.detected
        or not (sheet.bandwidth or sheet.sample_rate)
    ):
        return ""
    folded = sheet.folded(rate)
    slack = math.exp(min(_log_ratio_tolerance(ratio), 0.1))
    if folded is None or not folded[0] / slack <= ratio.value <= folded[1] * slack:
        return ""
    return (
        f"looks as if samples were skipped to reach {rate:g} Hz: noise at higher frequencies is then folded"
        f" down (aliasing), and N is too large by a factor of {folded[0]:.3g}"
        + (f" to {folded[1]:.3g}" if folded[1] > 1.001 * folded[0] else "")
        + "; log at a higher rate and average"
    )
